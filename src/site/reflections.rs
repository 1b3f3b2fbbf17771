//! What walls, ceiling and floor are made of, for beams that are pointed at a reflection.

use serde::{Deserialize, Serialize};

/// Surfaces that reflect radio. A site with this section lets access points serve a device by a single reflection too.
///
/// ```
/// use umbracast::{Config, Mode, site::Material};
///
/// let file = "[site.reflections]\nwalls = \"plasterboard\"\nfloor = \"none\"";
/// let site = Config::with_overlay(Mode::Default, file, "hall.toml")?.site;
/// let surfaces = site.reflections.unwrap();
/// assert_eq!((surfaces.walls, surfaces.ceiling, surfaces.floor), (Material::Plasterboard, Material::Concrete, Material::None));
/// assert!(Config::default().site.reflections.is_none());
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Reflections {
    /// Of every wall.
    pub walls: Material,
    /// At the hall's height.
    pub ceiling: Material,
    /// At height 0.
    pub floor: Material,
}

/// What a surface is made of.
///
/// ```
/// use umbracast::site::Material;
///
/// // Straight on, concrete reflects ((1 - n) / (1 + n))^2 of the power, with n^2 = 5.24.
/// assert!((Material::Concrete.swallowed_db(1.0) - 8.14).abs() < 0.01);
/// assert_eq!((Material::Metal.swallowed_db(0.3), Material::None.swallowed_db(0.3)), (0.0, f64::INFINITY));
/// ```
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Material {
    /// Nothing is reflected.
    None,
    /// The usual one.
    #[default]
    Concrete,
    /// Bare or painted.
    Brick,
    /// Of light walls.
    Plasterboard,
    /// Solid.
    Wood,
    /// Of fronts and windows.
    Glass,
    /// Of suspended ceilings.
    CeilingBoard,
    /// Of furniture and light walls.
    Chipboard,
    /// Of light walls.
    Plywood,
    /// Of halls.
    Marble,
    /// Of floors.
    Floorboard,
    /// All is reflected.
    Metal,
}

impl Material {
    /// How much weaker a reflected wave is, by the cosine of its angle to the surface's normal: Fresnel's equations for a half
    /// space (ITU-R P.2040-3, eq. 31), as the mean power of both polarisations. A thin board reflects more or less than that, by
    /// how thick it is in wavelengths.
    pub fn swallowed_db(self, cos: f64) -> f64 {
        let permittivity = match self.permittivity() {
            Some(permittivity) => permittivity,
            None if self == Self::Metal => return 0.0,
            None => return f64::INFINITY,
        };
        let inside = (permittivity - (1.0 - cos * cos)).max(0.0).sqrt();
        let across = (cos - inside) / (cos + inside);
        let along = (permittivity * cos - inside) / (permittivity * cos + inside);
        -10.0 * (0.5 * (across * across + along * along)).log10()
    }

    /// Relative permittivity (ITU-R P.2040-3, table 3, from 1 to 100 GHz; floorboard from 50); `None` of metal, and of nothing.
    /// Conductivity, which is left out, changes what is reflected by less than 0.1 dB.
    ///
    /// ```
    /// assert_eq!(umbracast::site::Material::Glass.permittivity(), Some(6.31));
    /// ```
    pub fn permittivity(self) -> Option<f64> {
        Some(match self {
            Self::None | Self::Metal => return None,
            Self::Concrete => 5.24,
            Self::Brick => 3.91,
            Self::Plasterboard => 2.73,
            Self::Wood => 1.99,
            Self::Glass => 6.31,
            Self::CeilingBoard => 1.48,
            Self::Chipboard => 2.58,
            Self::Plywood => 2.71,
            Self::Marble => 7.074,
            Self::Floorboard => 3.66,
        })
    }
}
