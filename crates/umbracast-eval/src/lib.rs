//! Scores, error budget, tables, figures and the report.
