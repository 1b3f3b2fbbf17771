//! Halls without furniture, as site files.

/// A hall with places for two sensors, in the middle of its short walls.
pub struct BareHall {
    pub length_m: f64,
    pub width_m: f64,
    pub height_m: f64,
    /// Where sensors hang, and by how much they look down.
    pub sensors_up_m: f64,
    pub sensors_down_deg: f64,
}

pub const SMALL_HALL: BareHall =
    BareHall { length_m: 20.0, width_m: 12.0, height_m: 4.0, sensors_up_m: 3.2, sensors_down_deg: 15.0 };

impl BareHall {
    /// Its site file with sensors of these models, the first on the east wall, and an access point on a long wall.
    pub fn site(&self, models: &[&str]) -> String {
        let Self { length_m, width_m, height_m, sensors_up_m, sensors_down_deg } = self;
        let hall = format!(
            "[site]\nname = \"bare\"\npillars = []\nfurniture = []\n[site.hall]\nlength_m = {length_m:?}\nwidth_m = {width_m:?}\n\
             height_m = {height_m:?}\n[[site.access_points]]\nname = \"wall\"\nposition_m = [0.0, {:?}, {:?}]\n",
            0.5 * width_m - 0.2,
            height_m - 1.0
        );
        let sensors = models.iter().zip([("lidar_east", 1.0, 180.0), ("lidar_west", -1.0, 0.0)]);
        let sensors = sensors.map(|(model, (name, side, yaw_deg))| {
            format!(
                "[[site.sensors]]\nname = \"{name}\"\nmodel = \"{model}\"\nposition_m = [{:?}, 0.0, {sensors_up_m:?}]\n\
                 rotation_deg = {{ yaw = {yaw_deg:?}, pitch = {sensors_down_deg:?}, roll = 0.0 }}\n",
                side * (0.5 * length_m - 0.4)
            )
        });
        hall + &sensors.collect::<String>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sensors_hang_on_the_short_walls_in_the_order_of_their_models() {
        let text = SMALL_HALL.site(&["points", "hdl-32e"]);
        for line in [
            "model = \"points\"\nposition_m = [9.6, 0.0, 3.2]",
            "model = \"hdl-32e\"\nposition_m = [-9.6, 0.0, 3.2]",
        ] {
            assert!(text.contains(line), "{text}");
        }
        assert!(text.contains("position_m = [0.0, 5.8, 3.0]"), "{text}");
        assert!(!SMALL_HALL.site(&["points"]).contains("lidar_west"));
    }
}
