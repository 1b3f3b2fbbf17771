//! Files and tables: pcap, PCD, MCAP recordings, trajectories, Parquet and CSV.

pub mod rows;
pub mod tables;
