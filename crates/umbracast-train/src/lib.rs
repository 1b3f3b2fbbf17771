//! Fits the forecasters.
