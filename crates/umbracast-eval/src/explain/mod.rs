//! Why the paper's figures are what they are: its stages 2 and 3 played on true trajectories to which an error of stage 1
//! is added, and a search for the error, the box and the access point under which they print what was published.

pub mod replay;
pub mod table_one;
pub mod search;
pub mod figure;
