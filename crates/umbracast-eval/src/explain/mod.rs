//! Why the paper's figures are what they are: its stages 2 and 3 on true trajectories with an added error of stage 1,
//! and a search for the error, the box and the access point that give the published figures.

pub mod replay;
pub mod table_one;
pub mod search;
pub mod figure;
