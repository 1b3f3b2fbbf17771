//! The best velocity under half-plane constraints: two-dimensional linear programs, solved line by line.

use glam::Vec2;

/// Directions whose cross product is smaller count as parallel.
const PARALLEL: f32 = 1e-5;

/// Allowed velocities lie to the left of a directed line.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct HalfPlane {
    pub point: Vec2,
    /// Of unit length.
    pub direction: Vec2,
}

/// What a program looks for.
#[derive(Clone, Copy)]
enum Goal {
    /// The velocity nearest to this one.
    Nearest(Vec2),
    /// As far as possible this way (of unit length).
    Along(Vec2),
}

impl HalfPlane {
    /// How far a velocity is on the forbidden side; negative on the allowed one.
    fn violation(&self, velocity: Vec2) -> f32 {
        self.direction.perp_dot(self.point - velocity)
    }

    fn at(&self, t: f32) -> Vec2 {
        self.point + self.direction * t
    }
}

/// Directions of the two tangents from the origin to a disc at `center`, left and right one.
pub(super) fn tangents(center: Vec2, radius: f32, distance_sq: f32) -> (Vec2, Vec2) {
    let leg = (distance_sq - radius * radius).sqrt();
    let left = Vec2::new(center.x * leg - center.y * radius, center.x * radius + center.y * leg);
    let right = Vec2::new(center.x * leg + center.y * radius, -center.x * radius + center.y * leg);
    // RVO2 divides vectors by multiplying with the reciprocal; so must every division here.
    let inverse = 1.0 / distance_sq;
    (left * inverse, right * inverse)
}

/// The velocity nearest to `preferred` that satisfies all lines and the greatest speed. Where none does, the
/// one that violates the lines after the first `hard` ones least (those are obstacles, which never give way).
pub(super) fn nearest_allowed(lines: &[HalfPlane], hard: usize, max_speed: f32, preferred: Vec2) -> Vec2 {
    match solve(lines, max_speed, Goal::Nearest(preferred)) {
        Ok(velocity) => velocity,
        Err((failed, velocity)) => least_violation(lines, hard, failed, max_speed, velocity),
    }
}

/// The optimum under all lines; or the first line that cannot be met and the optimum under those before it.
fn solve(lines: &[HalfPlane], max_speed: f32, goal: Goal) -> Result<Vec2, (usize, Vec2)> {
    let mut best = match goal {
        Goal::Along(direction) => direction * max_speed,
        Goal::Nearest(v) if v.length_squared() > max_speed * max_speed => {
            v * (1.0 / v.length_squared().sqrt()) * max_speed
        }
        Goal::Nearest(v) => v,
    };
    for (i, line) in lines.iter().enumerate() {
        if line.violation(best) > 0.0 {
            best = best_on_line(line, &lines[..i], max_speed, goal).ok_or((i, best))?;
        }
    }
    Ok(best)
}

/// The optimum on one line, among the lines before it; `None` if they leave nothing of it.
fn best_on_line(line: &HalfPlane, before: &[HalfPlane], max_speed: f32, goal: Goal) -> Option<Vec2> {
    let middle = line.point.dot(line.direction);
    let discriminant = middle * middle + max_speed * max_speed - line.point.length_squared();
    if discriminant < 0.0 {
        return None;
    }
    let half_chord = discriminant.sqrt();
    let (mut low, mut high) = (-middle - half_chord, -middle + half_chord);

    for other in before {
        let slope = line.direction.perp_dot(other.direction);
        let offset = other.direction.perp_dot(line.point - other.point);
        if slope.abs() <= PARALLEL {
            if offset < 0.0 {
                return None;
            }
            continue;
        }
        let t = offset / slope;
        if slope >= 0.0 {
            if t < high {
                high = t;
            }
        } else if t > low {
            low = t;
        }
        if low > high {
            return None;
        }
    }

    let t = match goal {
        Goal::Along(direction) if direction.dot(line.direction) > 0.0 => high,
        Goal::Along(_) => low,
        Goal::Nearest(velocity) => {
            let t = line.direction.dot(velocity - line.point);
            if t < low {
                low
            } else if t > high {
                high
            } else {
                t
            }
        }
    };
    Some(line.at(t))
}

/// Moves all soft lines back evenly until they leave one velocity.
fn least_violation(lines: &[HalfPlane], hard: usize, failed: usize, max_speed: f32, mut best: Vec2) -> Vec2 {
    let mut distance = 0.0;
    let mut projected = Vec::with_capacity(lines.len());
    for (i, line) in lines.iter().enumerate().skip(failed) {
        if line.violation(best) <= distance {
            continue;
        }
        // Where the line and an earlier one are violated alike.
        projected.clear();
        projected.extend_from_slice(&lines[..hard]);
        for other in &lines[hard..i] {
            let slope = line.direction.perp_dot(other.direction);
            let point = if slope.abs() > PARALLEL {
                line.at(other.direction.perp_dot(line.point - other.point) / slope)
            } else if line.direction.dot(other.direction) > 0.0 {
                continue;
            } else {
                (line.point + other.point) * 0.5
            };
            let direction = other.direction - line.direction;
            let direction = direction * (1.0 / direction.length_squared().sqrt());
            projected.push(HalfPlane { point, direction });
        }
        // Only rounding can leave nothing: then the velocity so far stays.
        if let Ok(velocity) = solve(&projected, max_speed, Goal::Along(line.direction.perp())) {
            best = velocity;
        }
        distance = line.violation(best);
    }
    best
}
