//! Columns that are known at run time only.

/// A column of a table whose columns depend on the site.
#[derive(Debug, Clone, PartialEq)]
pub enum Values {
    /// Measures.
    F64(Vec<f64>),
    /// Measures, null where there is none.
    MaybeF64(Vec<Option<f64>>),
    /// Counts.
    U32(Vec<u32>),
    /// Yes or no.
    Bool(Vec<bool>),
}

impl Values {
    /// Rows.
    pub fn len(&self) -> usize {
        match self {
            Self::F64(v) => v.len(),
            Self::MaybeF64(v) => v.len(),
            Self::U32(v) => v.len(),
            Self::Bool(v) => v.len(),
        }
    }

    /// True without a row.
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }
}
