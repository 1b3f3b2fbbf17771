//! Files, tables and messages: pcap, PCD, MCAP recordings, trajectories, motion captures, Parquet and CSV; and what a run reads
//! before it starts: configuration, weights and input.

mod lzf;
mod seam;
pub mod pcap;
pub mod pcd;
pub mod rows;
pub mod clouds;
pub mod cdr;
pub mod messages;
pub mod point_cloud;
pub mod tables;
pub mod wire;
pub mod fields;
mod health;
pub mod nodes;
pub mod viewers;
pub mod results;
pub mod objects;
pub mod recording;
pub mod setup;
pub mod input;
pub mod outcome_tables;
pub mod ply;
pub mod las;
pub mod geojson;
pub mod own_tracks;
pub mod reports;
pub mod trajectories;
pub mod bvh;
pub mod turns;
pub mod motion;
