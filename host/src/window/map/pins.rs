//! Persons and the places where they may be.

use super::lettering::Letters;
use super::marks::width;
use super::overlay::{Foot, Person, Role};
use super::palette::{Rgb, colour};
use super::widget::Scenery;
use crate::particle::Cluster;
use eframe::egui::{Align2, Painter, Pos2, Rect, Shape, Stroke, vec2};
use nalgebra::Matrix2;

/// More clusters, and less likely ones, have no badge.
const MOST_CLUSTERS: usize = 12;
const LEAST_PROBABILITY: f64 = 0.005;
/// An ellipse of two standard deviations holds 86 % of a normal distribution in the plane.
const SIGMAS: f64 = 2.0;
/// **Units:** m.
const SMALLEST_RADIUS_M: f64 = 0.25;
/// **Units:** points.
const DOT: f32 = 6.5;

/// Where in the window persons and clusters are.
#[derive(Clone, Debug, Default)]
pub struct Pinned {
    people: Vec<(usize, Pos2)>,
    clusters: Vec<(usize, Rect)>,
}

impl Pinned {
    /// The person at a point.
    pub fn person_at(&self, at: Pos2) -> Option<usize> {
        let near = self.people.iter().filter(|(_, place)| place.distance(at) < DOT + 5.0);
        near.min_by(|a, b| a.1.distance(at).total_cmp(&b.1.distance(at))).map(|(index, _)| *index)
    }

    /// The cluster whose badge or middle is at a point.
    pub fn cluster_at(&self, at: Pos2) -> Option<usize> {
        self.clusters.iter().find(|(_, rect)| rect.contains(at)).map(|(index, _)| *index)
    }
}

/// Draws them and tells where they are. `picked` is the cluster whose details are shown.
pub fn draw(painter: &Painter, letters: &mut Letters<'_>, scenery: &Scenery<'_>, picked: Option<usize>) -> Pinned {
    let mut pinned = Pinned::default();
    let overlay = scenery.overlay;
    // A single place needs no rank; the person stands there.
    if scenery.view.layers.clusters && overlay.clusters.len() > 1 {
        for (index, cluster) in overlay.clusters.iter().enumerate().take(MOST_CLUSTERS) {
            let drawn = scenery.scene.storey(cluster.floor).is_some_and(|(storey, _)| scenery.is_drawn(storey));
            if drawn && cluster.probability >= LEAST_PROBABILITY {
                let rects = place(painter, letters, scenery, index, cluster, picked == Some(index));
                pinned.clusters.extend(rects.into_iter().map(|rect| (index, rect)));
            }
        }
    }
    if scenery.view.layers.shows(Role::Free) {
        overlay.feet.iter().for_each(|foot| leg(painter, scenery, foot));
    }
    let named = overlay.people.len() > 1;
    for (index, someone) in overlay.people.iter().enumerate() {
        if let Some(at) = person(painter, letters, scenery, someone, named) {
            pinned.people.push((index, at));
        }
    }
    pinned
}

/// The ellipse of a covariance around a place, in the window.
fn ellipse(scenery: &Scenery<'_>, centre: [f64; 3], covariance: Matrix2<f64>) -> Vec<Pos2> {
    let eigen = covariance.symmetric_eigen();
    let radius = |index: usize| (SIGMAS * eigen.eigenvalues[index].max(0.0).sqrt()).max(SMALLEST_RADIUS_M);
    let axes = [0, 1].map(|index| eigen.eigenvectors.column(index) * radius(index));
    let points = (0..48).map(|part| {
        let (sin, cos) = (f64::from(part) / 48.0 * std::f64::consts::TAU).sin_cos();
        let offset = axes[0] * cos + axes[1] * sin;
        scenery.at([centre[0] + offset.x, centre[1] + offset.y, centre[2]])
    });
    points.collect::<Option<Vec<Pos2>>>().unwrap_or_default()
}

fn place(
    painter: &Painter,
    letters: &mut Letters<'_>,
    scenery: &Scenery<'_>,
    index: usize,
    cluster: &Cluster,
    picked: bool,
) -> Vec<Rect> {
    let rgb: Rgb = scenery.palette.particles;
    let centre = [cluster.position.x, cluster.position.y, cluster.position.z];
    let Some(at) = scenery.at(centre) else { return Vec::new() };
    let covariance = cluster.covariance.fixed_view::<2, 2>(0, 0).into_owned();
    let outline = ellipse(scenery, centre, covariance);
    let strong = if picked { 1.0 } else { 0.8 };
    let stroke = Stroke::new(if picked { 2.5 } else { 1.5 }, colour(rgb).gamma_multiply(strong));
    painter.add(Shape::convex_polygon(outline, colour(rgb).gamma_multiply(0.13), stroke));
    let percent = cluster.probability * 100.0;
    let percent = if percent < 10.0 { format!("{percent:.1}") } else { format!("{percent:.0}") };
    let text = if picked {
        let heading = cluster.heading.to_degrees();
        let sigma = cluster.sigma_m();
        format!(
            "place {} of {}: {percent} %\n{} particles, ±{sigma:.1} m\nheading {heading:.0}°",
            index + 1,
            scenery.overlay.clusters.len(),
            cluster.count
        )
    } else {
        format!("{} · {percent} %", index + 1)
    };
    let badge = letters.badge(&text, at - vec2(0.0, 12.0), Align2::CENTER_BOTTOM, rgb);
    painter.circle_filled(at, 3.0, colour(rgb));
    vec![badge, Rect::from_center_size(at, vec2(20.0, 20.0))]
}

/// The way goes on to where the foot is. It moves with each sample, for which the map is not drawn anew.
fn leg(painter: &Painter, scenery: &Scenery<'_>, foot: &Foot) {
    let storey = scenery.scene.storey_at(foot.from[2].min(foot.to[2]));
    let (true, Some(from), Some(to)) = (scenery.is_drawn(storey), scenery.at(foot.from), scenery.at(foot.to)) else {
        return;
    };
    let width = width(Role::Free);
    for (width, rgb) in [(width + 2.2, scenery.palette.casing), (width, scenery.palette.role(Role::Free))] {
        painter.line_segment([from, to], Stroke::new(width, colour(rgb)));
    }
}

fn person(
    painter: &Painter,
    letters: &mut Letters<'_>,
    scenery: &Scenery<'_>,
    person: &Person,
    named: bool,
) -> Option<Pos2> {
    let drawn = scenery.scene.storey(person.floor).is_none_or(|(storey, _)| scenery.is_drawn(storey));
    if !drawn {
        return None;
    }
    let at = scenery.at(person.position)?;
    let rgb = person.colour.unwrap_or(scenery.palette.role(Role::Estimate));
    let strong = if person.selected || !named { 1.0 } else { 0.7 };
    let fill = colour(rgb).gamma_multiply(strong);
    // The share of the standard deviation along each of three axes, of which two are in the plane.
    let variance = person.sigma_m * person.sigma_m / 2.0;
    let around = ellipse(scenery, person.position, Matrix2::identity() * variance);
    let rim = Stroke::new(1.0, colour(rgb).gamma_multiply(0.5));
    painter.add(Shape::convex_polygon(around, colour(rgb).gamma_multiply(0.12), rim));
    if let Some(heading) = person.heading {
        wedge(painter, scenery, person.position, heading, rgb);
    }
    painter.circle_filled(at, DOT + 2.0, colour([0xff; 3]));
    painter.circle_filled(at, DOT, fill);
    letters.take(Rect::from_center_size(at, vec2(2.0 * DOT, 2.0 * DOT)).expand(3.0));
    if named && !person.name.is_empty() {
        letters.badge(&person.name, at + vec2(0.0, DOT + 6.0), Align2::CENTER_TOP, rgb);
    }
    Some(at)
}

/// A pointed shape in the direction that somebody looks, lying on the floor.
fn wedge(painter: &Painter, scenery: &Scenery<'_>, [x, y, z]: [f64; 3], heading: f64, rgb: Rgb) {
    let scale = scenery.sight.scale_at(scenery.scene.shown([x, y, z], scenery.spread));
    let corner = |turn: f64, far: f64| {
        let (sin, cos) = (heading + turn).sin_cos();
        scenery.at([x + far / scale * cos, y + far / scale * sin, z])
    };
    let tip = f64::from(DOT) * 3.6;
    let foot = f64::from(DOT) * 1.35;
    let corners = [corner(0.0, tip), corner(1.05, foot), corner(-1.05, foot)];
    if let [Some(a), Some(b), Some(c)] = corners {
        painter.add(Shape::convex_polygon(vec![a, b, c], colour(rgb), Stroke::new(1.5, colour([0xff; 3]))));
    }
}
