//! Any file gives points, payloads or an error.
#![no_main]

use libfuzzer_sys::fuzz_target;
use umbracast_io::pcap::PcapReader;
use umbracast_io::pcd::read_pcd;

fuzz_target!(|bytes: &[u8]| {
    if let Ok(cloud) = read_pcd(bytes, "fuzz.pcd") {
        assert!(cloud.fields.iter().all(|f| f.values.len() == cloud.width * cloud.height * f.count));
    }
    if let Ok(reader) = PcapReader::new(bytes, "fuzz.pcap") {
        assert!(reader.count() <= bytes.len() / 16);
    }
});
