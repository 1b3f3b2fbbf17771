//! Half-planes that keep an agent off the edges of polygons.

use glam::Vec2;

use super::agent::Agent;
use super::velocity::{HalfPlane, tangents};

/// Lines that clear an edge by less still count as covering it.
const COVERED: f32 = 1e-5;

/// A corner of a polygon and the edge that leaves it.
#[derive(Debug, Clone, Copy)]
pub(super) struct Corner {
    point: Vec2,
    /// Of the edge to the next corner.
    direction: Vec2,
    convex: bool,
    next: usize,
    previous: usize,
}

/// The corners of all polygons. A polygon of two corners is a wall, convex at both ends.
pub(super) fn corners(polygons: &[Vec<Vec2>]) -> Vec<Corner> {
    let mut corners = Vec::new();
    for polygon in polygons.iter().filter(|p| p.len() >= 2) {
        let (first, n) = (corners.len(), polygon.len());
        for (i, &point) in polygon.iter().enumerate() {
            let (before, after) = ((i + n - 1) % n, (i + 1) % n);
            let edge = polygon[after] - point;
            corners.push(Corner {
                point,
                direction: edge * (1.0 / edge.length_squared().sqrt()),
                convex: n == 2 || left_of(polygon[before], point, polygon[after]) >= 0.0,
                next: first + after,
                previous: first + before,
            });
        }
    }
    corners
}

/// Edges whose outer side the agent can reach within the horizon, nearest first, as (squared distance, index
/// of the corner they leave). Equally near ones (they share a corner) keep the polygon's order.
pub(super) fn visible_edges(corners: &[Corner], agent: &Agent, edges: &mut Vec<(f32, usize)>) {
    let p = &agent.parameters;
    let range = p.obstacle_horizon_s * p.max_speed_mps + p.radius_m;
    edges.clear();
    for (i, corner) in corners.iter().enumerate() {
        let (a, b) = (corner.point, corners[corner.next].point);
        let distance_sq = distance_sq_to_segment(a, b, agent.position_m);
        if left_of(a, b, agent.position_m) < 0.0 && distance_sq < range * range {
            edges.push((distance_sq, i));
        }
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));
}

/// The half-plane of one edge; `None` where the lines so far, a neighbouring edge or a concave corner do it.
pub(super) fn half_plane(
    corners: &[Corner],
    edge: usize,
    agent: &Agent,
    so_far: &[HalfPlane],
) -> Option<HalfPlane> {
    let (mut start, mut end) = (&corners[edge], &corners[corners[edge].next]);
    let radius = agent.parameters.radius_m;
    let radius_sq = radius * radius;
    let inverse_time = 1.0 / agent.parameters.obstacle_horizon_s;
    let to_start = start.point - agent.position_m;
    let to_end = end.point - agent.position_m;

    let clears = |line: &HalfPlane, to: Vec2| {
        (to * inverse_time - line.point).perp_dot(line.direction) - inverse_time * radius >= -COVERED
    };
    if so_far.iter().any(|line| clears(line, to_start) && clears(line, to_end)) {
        return None;
    }

    let start_sq = to_start.length_squared();
    let end_sq = to_end.length_squared();
    let along = end.point - start.point;
    // Where the agent's foot falls on the edge: 0 at its start, 1 at its end.
    let foot = (-to_start).dot(along) / along.length_squared();
    let line_sq = (-to_start - along * foot).length_squared();

    // Touching: whatever does not go closer is allowed.
    let touching = |direction: Vec2| Some(HalfPlane { point: Vec2::ZERO, direction });
    let away_from = |to: Vec2| to.perp() * (1.0 / to.perp().length_squared().sqrt());
    if foot < 0.0 && start_sq <= radius_sq {
        return if start.convex { touching(away_from(to_start)) } else { None };
    }
    if foot > 1.0 && end_sq <= radius_sq {
        let ours = end.convex && to_end.perp_dot(end.direction) >= 0.0;
        return if ours { touching(away_from(to_end)) } else { None };
    }
    if (0.0..=1.0).contains(&foot) && line_sq <= radius_sq {
        return touching(-start.direction);
    }

    // The forbidden velocities are a truncated cone between two legs. Seen obliquely, both legs belong to the
    // nearer corner; at a concave corner the leg continues the edge.
    let (mut left, mut right);
    if foot < 0.0 && line_sq <= radius_sq {
        if !start.convex {
            return None;
        }
        end = start;
        (left, right) = tangents(to_start, radius, start_sq);
    } else if foot > 1.0 && line_sq <= radius_sq {
        if !end.convex {
            return None;
        }
        start = end;
        (left, right) = tangents(to_end, radius, end_sq);
    } else {
        left = if start.convex { tangents(to_start, radius, start_sq).0 } else { -start.direction };
        right = if end.convex { tangents(to_end, radius, end_sq).1 } else { start.direction };
    }

    // A leg that points into the neighbouring edge is replaced by it, and what falls there is that edge's job.
    let before = -corners[start.previous].direction;
    let left_foreign = start.convex && left.perp_dot(before) >= 0.0;
    if left_foreign {
        left = before;
    }
    let right_foreign = end.convex && right.perp_dot(end.direction) <= 0.0;
    if right_foreign {
        right = end.direction;
    }

    // Which part of the cone's border is nearest to the current velocity: a round tip, the front or a leg?
    let left_tip = (start.point - agent.position_m) * inverse_time;
    let right_tip = (end.point - agent.position_m) * inverse_time;
    let front = right_tip - left_tip;
    let one_corner = std::ptr::eq(start, end);
    let velocity = agent.velocity_mps;
    let t = if one_corner { 0.5 } else { (velocity - left_tip).dot(front) / front.length_squared() };
    let t_left = (velocity - left_tip).dot(left);
    let t_right = (velocity - right_tip).dot(right);

    let round = |tip: Vec2| {
        let from_tip = velocity - tip;
        let outward = from_tip * (1.0 / from_tip.length_squared().sqrt());
        Some(HalfPlane { point: tip + outward * (radius * inverse_time), direction: -outward.perp() })
    };
    let straight = |tip: Vec2, direction: Vec2| {
        Some(HalfPlane { point: tip + direction.perp() * (radius * inverse_time), direction })
    };
    if (t < 0.0 && t_left < 0.0) || (one_corner && t_left < 0.0 && t_right < 0.0) {
        return round(left_tip);
    }
    if t > 1.0 && t_right < 0.0 {
        return round(right_tip);
    }
    let unless = |outside: bool, border: Vec2| {
        if outside { f32::INFINITY } else { (velocity - border).length_squared() }
    };
    let front_sq = unless(!(0.0..=1.0).contains(&t) || one_corner, left_tip + front * t);
    let left_sq = unless(t_left < 0.0, left_tip + left * t_left);
    let right_sq = unless(t_right < 0.0, right_tip + right * t_right);
    if front_sq <= left_sq && front_sq <= right_sq {
        straight(left_tip, -start.direction)
    } else if left_sq <= right_sq {
        if left_foreign { None } else { straight(left_tip, left) }
    } else if right_foreign {
        None
    } else {
        straight(right_tip, -right)
    }
}

/// Positive where `c` lies left of the line from `a` to `b`.
fn left_of(a: Vec2, b: Vec2, c: Vec2) -> f32 {
    (a - c).perp_dot(b - a)
}

fn distance_sq_to_segment(a: Vec2, b: Vec2, c: Vec2) -> f32 {
    let r = (c - a).dot(b - a) / (b - a).length_squared();
    if r < 0.0 {
        (c - a).length_squared()
    } else if r > 1.0 {
        (c - b).length_squared()
    } else {
        (c - (a + (b - a) * r)).length_squared()
    }
}
