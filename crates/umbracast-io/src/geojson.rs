//! Hall, ways of people, and links as GeoJSON, for QGIS and web maps: in the site's metres, or as longitude and latitude where the
//! site's place on Earth is known. Format: RFC 7946, which asks for longitude and latitude.
//!
//! Written by hand: a head, a line for each feature, an end; nothing grows with a recording but the ways of one scene.

use std::collections::BTreeMap;
use std::io::{self, Write};
use std::str::FromStr;

use glam::DVec2;
use serde_json::{Value, json};
use umbracast::geometry::DVec3;
use umbracast::{Error, STEPS, Site};

use crate::clouds::ends_m;
use crate::rows::{LinkRow, TrackRow};

/// WGS 84: half the long axis in metres, and the square of the eccentricity.
const EARTH_M: f64 = 6_378_137.0;
const EARTH_E2: f64 = 6.694_379_990_14e-3;

/// Where the origin of the site's frame is on Earth.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Origin {
    /// Degrees north, WGS 84.
    pub latitude_deg: f64,
    /// Degrees east, WGS 84.
    pub longitude_deg: f64,
    /// How far the site's x axis is turned from east to north.
    pub turn_deg: f64,
}

impl FromStr for Origin {
    type Err = Error;

    /// `LAT,LON` or `LAT,LON,TURN`, degrees.
    fn from_str(text: &str) -> Result<Self, Error> {
        let numbers: Option<Vec<f64>> =
            text.split(',').map(|n| n.trim().parse().ok().filter(|n: &f64| n.is_finite())).collect();
        let (latitude_deg, longitude_deg, turn_deg) = match numbers.as_deref() {
            Some(&[latitude_deg, longitude_deg]) => (latitude_deg, longitude_deg, 0.0),
            Some(&[latitude_deg, longitude_deg, turn_deg]) => (latitude_deg, longitude_deg, turn_deg),
            _ => {
                return Err(Error::new(format!(
                    "expected LAT,LON or LAT,LON,TURN in degrees, found {text:?}"
                )));
            }
        };
        // A map has no room at the poles.
        if latitude_deg.abs() > 89.0 || longitude_deg.abs() > 180.0 {
            let story = format!(
                "expected a latitude of -89 to 89 and a longitude of -180 to 180 degrees, found {text:?}"
            );
            return Err(Error::new(story));
        }
        Ok(Self { latitude_deg, longitude_deg, turn_deg })
    }
}

impl Origin {
    /// Longitude and latitude, degrees, of a place in the site's frame, metres; exact to millimetres within a kilometre.
    pub fn place(&self, at_m: DVec2) -> [f64; 2] {
        let [east_m, north_m] = DVec2::from_angle(self.turn_deg.to_radians()).rotate(at_m).to_array();
        let (sin, cos) = self.latitude_deg.to_radians().sin_cos();
        let flat = 1.0 - EARTH_E2 * sin * sin;
        let along_m = EARTH_M * (1.0 - EARTH_E2) / flat.powf(1.5);
        let across_m = EARTH_M / flat.sqrt() * cos;
        [
            self.longitude_deg + (east_m / across_m).to_degrees(),
            self.latitude_deg + (north_m / along_m).to_degrees(),
        ]
    }
}

/// A file of features in the making.
#[derive(Debug)]
pub struct GeoJson<W> {
    output: W,
    origin: Option<Origin>,
    features: usize,
}

impl<W: Write> GeoJson<W> {
    /// Begins a file; without an origin coordinates are the site's metres.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn new(mut output: W, name: &str, origin: Option<Origin>) -> io::Result<Self> {
        write!(output, "{{\"type\":\"FeatureCollection\",\"name\":{},\"features\":[", json!(name))?;
        Ok(Self { output, origin, features: 0 })
    }

    /// The hall's outline, pillars, furniture, sensors and access points.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn site(&mut self, site: &Site) -> io::Result<()> {
        let ring = |corners: Vec<DVec2>| -> Vec<DVec3> {
            corners.iter().chain(corners.first()).map(|corner| corner.extend(0.0)).collect()
        };
        self.polygon(ring(site.hall.corners()), json!({ "kind": "hall", "name": site.name }))?;
        for furniture in &site.furniture {
            self.polygon(ring(furniture.corners().to_vec()), json!({ "kind": "furniture" }))?;
        }
        for pillar in &site.pillars {
            let at_m = DVec2::from_array(pillar.position_m).extend(0.0);
            self.point(at_m, json!({ "kind": "pillar", "radius_m": pillar.radius_m }))?;
        }
        for sensor in &site.sensors {
            let properties = json!({ "kind": "sensor", "name": sensor.name, "model": sensor.model });
            self.point(DVec3::from_array(sensor.position_m), properties)?;
        }
        for ap in &site.access_points {
            self.point(ap.position(), json!({ "kind": "access_point", "name": ap.name }))?;
        }
        Ok(())
    }

    /// The links of one frame, each a line from its access point to the device. `time_ms` counts from 1970.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn links(&mut self, site: &Site, tracks: &[TrackRow], links: &[LinkRow]) -> io::Result<()> {
        for link in links {
            let Some(ends_m) = ends_m(site, tracks, link) else { continue };
            let properties = json!({
                "access_point": site.access_points[link.access_point as usize].name, "track": link.track,
                "frame": link.frame, "time_ms": link.time_ns.div_euclid(1_000_000), "blocked_now": link.is_blocked(),
                "p_now": rounded(link.p_of_any(0), 1e4), "p_w9": rounded(link.p_of_any(STEPS), 1e4), "cause": link.cause(),
            });
            self.line(&ends_m, properties)?;
        }
        Ok(())
    }

    /// Everybody's way as a line, or as a point of who was seen once.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn ways(&mut self, ways: &Ways) -> io::Result<()> {
        for (track, way) in &ways.0 {
            let properties = json!({
                "track": track, "from_ms": way.from_ns.div_euclid(1_000_000), "to_ms": way.to_ns.div_euclid(1_000_000),
                "height_m": rounded(way.height_m, 1e3), "length_m": rounded(length_m(&way.places_m), 1e3),
            });
            match way.places_m[..] {
                [place_m] => self.point(place_m, properties)?,
                _ => self.line(&way.places_m, properties)?,
            }
        }
        Ok(())
    }

    /// Writes the end of the file.
    ///
    /// # Errors
    /// An output that cannot be written.
    pub fn finish(mut self) -> io::Result<W> {
        self.output.write_all(b"\n]}\n")?;
        self.output.flush()?;
        Ok(self.output)
    }

    fn point(&mut self, at_m: DVec3, properties: Value) -> io::Result<()> {
        let coordinates = json!(self.position(at_m));
        self.feature("Point", coordinates, properties)
    }

    fn line(&mut self, places_m: &[DVec3], properties: Value) -> io::Result<()> {
        let coordinates: Vec<[f64; 3]> = places_m.iter().map(|&at_m| self.position(at_m)).collect();
        self.feature("LineString", json!(coordinates), properties)
    }

    fn polygon(&mut self, ring_m: Vec<DVec3>, properties: Value) -> io::Result<()> {
        let ring: Vec<[f64; 3]> = ring_m.into_iter().map(|at_m| self.position(at_m)).collect();
        self.feature("Polygon", json!([ring]), properties)
    }

    fn feature(&mut self, kind: &str, coordinates: Value, properties: Value) -> io::Result<()> {
        let comma = if self.features == 0 { "" } else { "," };
        self.features += 1;
        let geometry = json!({ "type": kind, "coordinates": coordinates });
        let feature = json!({ "type": "Feature", "properties": properties, "geometry": geometry });
        write!(self.output, "{comma}\n{feature}")
    }

    fn position(&self, at_m: DVec3) -> [f64; 3] {
        let height_m = rounded(at_m.z, 1e3);
        match &self.origin {
            Some(origin) => {
                let [longitude_deg, latitude_deg] = origin.place(at_m.truncate());
                [rounded(longitude_deg, 1e8), rounded(latitude_deg, 1e8), height_m]
            }
            None => [rounded(at_m.x, 1e3), rounded(at_m.y, 1e3), height_m],
        }
    }
}

/// The ways of everybody in a scene.
#[derive(Debug, Clone, Default)]
pub struct Ways(BTreeMap<u64, Way>);

#[derive(Debug, Clone)]
struct Way {
    from_ns: i64,
    to_ns: i64,
    height_m: f64,
    places_m: Vec<DVec3>,
}

impl Ways {
    /// Adds where everybody is in the next frame.
    pub fn add(&mut self, site: &Site, tracks: &[TrackRow]) {
        for row in tracks.iter().filter(|row| row.confirmed) {
            let (from_ns, at_m) = (row.time_ns, DVec2::new(row.x_m, row.y_m));
            let new = || Way { from_ns, to_ns: from_ns, height_m: 0.0, places_m: Vec::new() };
            let way = self.0.entry(row.track).or_insert_with(new);
            (way.to_ns, way.height_m) = (row.time_ns, row.height_m);
            way.places_m.push(at_m.extend(site.hall.floor_m(at_m)));
        }
    }
}

fn length_m(places_m: &[DVec3]) -> f64 {
    places_m.windows(2).map(|pair| pair[0].distance(pair[1])).sum()
}

/// To whole parts of `of`: what is written has no more digits than it is worth.
fn rounded(number: f64, of: f64) -> f64 {
    (number * of).round() / of
}

#[cfg(test)]
mod tests {
    use super::*;

    fn written(origin: Option<Origin>) -> Value {
        let site = umbracast::Config::default().site;
        let row = |frame: u64, track, x_m| TrackRow {
            frame,
            time_ns: 1_700_000_000_000_000_000 + 100_000_000 * frame as i64,
            track,
            x_m,
            confirmed: true,
            height_m: 1.75,
            ..TrackRow::default()
        };
        let frames = [vec![row(0, 3, 0.1), row(0, 4, 5.0)], vec![row(1, 3, 0.7000000000000001)]];
        let mut ways = Ways::default();
        let mut file = GeoJson::new(Vec::new(), "a \"hall\"", origin).unwrap();
        file.site(&site).unwrap();
        for tracks in &frames {
            ways.add(&site, tracks);
            let link = LinkRow {
                frame: tracks[0].frame,
                track: 3,
                access_point: 1,
                p_now: 0.25,
                ..LinkRow::default()
            };
            let stranger = LinkRow { access_point: 99, ..link };
            file.links(&site, tracks, &[link, stranger]).unwrap();
        }
        file.ways(&ways).unwrap();
        serde_json::from_slice(&file.finish().unwrap()).unwrap()
    }

    #[test]
    fn hall_links_and_ways_are_features_of_their_kind() {
        let all = written(None);
        let features = all["features"].as_array().unwrap();
        let of = |kind: &str| features.iter().filter(|f| f["geometry"]["type"] == kind).collect::<Vec<_>>();
        assert_eq!((&all["type"], &all["name"]), (&json!("FeatureCollection"), &json!("a \"hall\"")));
        assert_eq!(of("Polygon")[0]["properties"]["kind"], "hall");
        let ring = of("Polygon")[0]["geometry"]["coordinates"][0].as_array().unwrap();
        assert!(ring.len() == 5 && ring[0] == ring[4], "a ring is closed");
        let lines = of("LineString");
        assert_eq!(lines.len(), 3, "two links, one way: who was seen once is a point");
        assert_eq!(lines[0]["properties"]["access_point"], "centre");
        assert_eq!(lines[2]["geometry"]["coordinates"], json!([[0.1, 0.0, 0.0], [0.7, 0.0, 0.0]]));
        assert_eq!(
            lines[2]["properties"],
            json!({ "track": 3, "from_ms": 1_700_000_000_000_i64,
            "to_ms": 1_700_000_000_100_i64, "height_m": 1.75, "length_m": 0.6 })
        );
        assert!(of("Point").iter().any(|f| f["properties"]["track"] == 4));
    }

    #[test]
    fn an_origin_puts_the_hall_on_earth() {
        // A degree of latitude is 111.2 km at 50 degrees, one of longitude 71.7 km.
        let origin: Origin = "50.0, 8.5, 90".parse().unwrap();
        let [longitude_deg, latitude_deg] = origin.place(DVec2::new(100.0, 0.0));
        assert!((longitude_deg - 8.5).abs() < 1e-9 && (latitude_deg - 50.0 - 100.0 / 111_229.0).abs() < 1e-7);
        let [longitude_deg, _] = origin.place(DVec2::new(0.0, -100.0));
        assert!((longitude_deg - 8.5 - 100.0 / 71_696.0).abs() < 1e-7);
        let all = written(Some(origin));
        let hall = &all["features"][0]["geometry"]["coordinates"][0][0];
        assert!(
            (hall[0].as_f64().unwrap() - 8.5).abs() < 1e-3 && (hall[1].as_f64().unwrap() - 50.0).abs() < 1e-3
        );
        for wrong in ["50", "50,x", "50,8,9,1", "91,8", "50,181", "nan,0"] {
            assert!(wrong.parse::<Origin>().is_err(), "{wrong}");
        }
    }
}
