//! Surfaces that disturb simulated light: panes, edges, dark cloth.

use serde::{Deserialize, Serialize};

/// An upright sheet of glass or a mirror: free-standing, or on a wall or a piece of furniture. Simulated sensors see
/// it; people, radio and truth do not.
///
/// ```
/// use umbracast::{Config, Mode, site::Surface};
///
/// let file = "[[site.simulation.panes]]\nfrom_m = [17.0, -2.0]\nto_m = [17.0, 2.0]\ntop_m = 2.5\nsurface = \"glass\"";
/// let pane = Config::with_overlay(Mode::Default, file, "window.toml")?.site.simulation.panes[0];
/// assert_eq!((pane.surface, pane.bottom_m), (Surface::Glass, 0.0));
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pane {
    /// One end of it over the floor, metres.
    pub from_m: [f64; 2],
    /// The other end.
    pub to_m: [f64; 2],
    /// Its lower edge above the floor.
    #[serde(default)]
    pub bottom_m: f64,
    /// Its upper edge.
    pub top_m: f64,
    /// What it is made of.
    pub surface: Surface,
}

/// What a pane is made of.
///
/// ```
/// assert_ne!(umbracast::site::Surface::Glass, umbracast::site::Surface::Mirror);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Surface {
    /// Lets most light through; the flatter it is met, the more it reflects.
    Glass,
    /// Reflects all.
    Mirror,
}

/// Beams are as wide as a data sheet says, and pulses as long: one that meets an edge returns a range between both
/// surfaces, where they are nearer to each other than the pulse is long.
///
/// ```
/// use umbracast::{Config, Mode};
///
/// let file = "[site.simulation]\nmixed_returns = { divergence_mrad = 3.0, pulse_m = 0.9 }";
/// let site = Config::with_overlay(Mode::Default, file, "edges.toml")?.site;
/// assert_eq!(site.simulation.mixed_returns.unwrap().pulse_m, 0.9);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MixedReturns {
    /// The whole angle of a beam across, milliradians.
    pub divergence_mrad: f64,
    /// Half the way that light goes during a pulse, metres.
    pub pulse_m: f64,
}

/// Cloth that swallows light.
///
/// ```
/// use umbracast::{Config, Mode};
///
/// let file = "[site.simulation]\ndark_cloth = { people = 0.5, dropout = 0.2 }";
/// let site = Config::with_overlay(Mode::Default, file, "dark.toml")?.site;
/// assert_eq!(site.simulation.dark_cloth.unwrap().people, 0.5);
/// # Ok::<(), umbracast::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct DarkCloth {
    /// Share of the people who wear it.
    pub people: f64,
    /// Share of the returns of these people that are lost beside all others.
    pub dropout: f64,
}
