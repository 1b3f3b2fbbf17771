//! Values on their way into a row, and columns that are known at run time only.

use std::fmt;

use umbracast::decide::Action;

use super::cells::Cell;

/// One value read.
#[derive(Debug, Clone, PartialEq)]
pub enum Value {
    /// A count, a number of something or a time.
    Whole(i64),
    /// A measure.
    Real(f64),
    /// Yes or no.
    Truth(bool),
    /// A name.
    Text(String),
    /// Nothing.
    Null,
}

impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Whole(v) => write!(f, "{v}"),
            Self::Real(v) => write!(f, "{v}"),
            Self::Truth(v) => write!(f, "{v}"),
            Self::Text(v) => write!(f, "{v:?}"),
            Self::Null => f.write_str("null"),
        }
    }
}

impl Value {
    /// Into a cell that it was read for; names are there as indices.
    pub(super) fn put(self, cell: Cell) {
        match (cell, self) {
            (Cell::U32(to) | Cell::AccessPoint(to), Self::Whole(v)) => *to = v as u32,
            (Cell::U64(to), Self::Whole(v)) => *to = v.cast_unsigned(),
            (Cell::MaybeU64(to), Self::Whole(v)) => *to = Some(v.cast_unsigned()),
            (Cell::MaybeU64(to), _) => *to = None,
            (Cell::I64(to), Self::Whole(v)) => *to = v,
            (Cell::F64(to), Self::Real(v)) => *to = v,
            (Cell::Bool(to), Self::Truth(v)) => *to = v,
            (Cell::MaybeBool(to), Self::Truth(v)) => *to = Some(v),
            (Cell::MaybeBool(to), _) => *to = None,
            (Cell::MaybeF64(to), Self::Real(v)) => *to = Some(v),
            (Cell::MaybeF64(to), _) => *to = None,
            (Cell::MaybeAccessPoint(to), Self::Whole(v)) => *to = Some(v as u32),
            (Cell::MaybeAccessPoint(to), _) => *to = None,
            (Cell::Action(to), Self::Whole(v)) => *to = Action::ALL[v as usize],
            (Cell::MaybeSurface(to), Self::Text(name)) => *to = name.parse().ok(),
            (Cell::MaybeSurface(to), _) => *to = None,
            _ => {}
        }
    }
}

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
