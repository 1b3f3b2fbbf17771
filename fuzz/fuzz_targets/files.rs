//! Any file gives points, payloads, poses or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast_io::bvh;
use umbracast_io::pcap::PcapReader;
use umbracast_io::pcd::read_pcd;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(cloud) = read_pcd(bytes, "fuzz.pcd") {
        assert!(cloud.fields.iter().all(|f| f.values.len() == cloud.width * cloud.height * f.count));
    }
    if let Ok(reader) = PcapReader::new(bytes, "fuzz.pcap") {
        assert!(reader.count() <= bytes.len() / 16);
    }
    if let Some(motion) = std::str::from_utf8(bytes).ok().and_then(|text| bvh::parse(text).ok()) {
        assert!(motion.positions.iter().all(|frame| frame.len() == motion.joints.len()));
    }
});
