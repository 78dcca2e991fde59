//! Polygons over named points, and polygons drawn along a way.

use super::body::{Body, newell};
use super::edges::residuals;
use super::shape::{Fitted, Names, best_plane};
use super::table::ShapeRow;
use super::{ModelError, NamedPoint, toward_cameras};
use glam::DVec3;

/// A ring of points, the plane nearest to them by their covariance, and each one's distance from it.
struct Ring {
    points: Vec<usize>,
    middle: DVec3,
    normal: DVec3,
}

fn ring(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Ring, ModelError> {
    let ring = names.points(&row.points)?;
    if ring.len() < 3 {
        return Err(names.refused(format!("has {} points; a polygon needs three", ring.len())));
    }
    if let Some(again) = (1..ring.len()).find(|&i| ring[..i].contains(&ring[i])) {
        return Err(names.refused(format!("names the point \"{}\" twice", row.points[again])));
    }
    let places: Vec<DVec3> = ring.iter().map(|&i| points[i].position).collect();
    let flat = || names.refused("has its points on a line".into());
    let mut normal = newell(&places).try_normalize().ok_or_else(flat)?;
    let mut middle = places[0];
    // weights ask for the normal and the normal for weights: two rounds settle it
    for _ in 0..3 {
        let weight = |i: usize| 1.0 / (normal.dot(points[i].covariance * normal) + names.tolerance_m * names.tolerance_m);
        let weighted: Vec<(DVec3, f64)> = ring.iter().map(|&i| (points[i].position, weight(i))).collect();
        let (new_middle, new) = best_plane(&weighted).ok_or_else(flat)?;
        (middle, normal) = (new_middle, if new.dot(normal) < 0.0 { -new } else { new });
    }
    Ok(Ring { points: ring, middle, normal })
}

impl Ring {
    fn off(&self, p: DVec3) -> DVec3 {
        self.normal * self.normal.dot(self.middle - p)
    }

    fn fitted(&self, body: Body, names: &Names, points: &[NamedPoint]) -> Fitted {
        let residuals: Vec<_> = self.points.iter().map(|&i| names.residual(&points[i], self.off(points[i].position))).collect();
        let worst = residuals.iter().max_by(|a, b| a.off_m.total_cmp(&b.off_m));
        let note = worst
            .filter(|worst| worst.sigmas > 3.0)
            .map(|worst| format!("is not flat: \"{}\" is {:.3} m off the plane through its points", worst.point, worst.off_m));
        Fitted { body, points: residuals, edges: Vec::new(), measures: Vec::new(), notes: note.into_iter().collect() }
    }
}

/// A polygon; the vertices are its points in their order, so that polygons of one part can share them.
pub(super) fn polygon(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let ring = ring(row, names, points)?;
    let mut body = Body::default();
    for &i in &ring.points {
        let p = points[i].position;
        body.vertex(if row.flatten { p + ring.off(p) } else { p });
    }
    let order: Vec<u32> = (0..ring.points.len() as u32).collect();
    if !body.polygon(&order) {
        return Err(names.refused("could not be cut into triangles: do its sides cross?".into()));
    }
    let to_eyes = toward_cameras(ring.middle, ring.points.iter().map(|&i| &points[i]), names.photographs);
    if !row.as_listed && ring.normal.dot(to_eyes) < 0.0 {
        body.flip();
    }
    Ok(Fitted { edges: residuals(row, names, points)?, ..ring.fitted(body, names, points) })
}

pub(super) fn extrusion(row: &ShapeRow, names: &Names, points: &[NamedPoint]) -> Result<Fitted, ModelError> {
    let edges = residuals(row, names, points)?;
    let mut ring = ring(row, names, points)?;
    let along =
        row.along.as_ref().ok_or_else(|| names.refused("needs along: two points whose difference it is drawn by".into()))?;
    let [a, b] = names.pair(along)?;
    let way = points[b].position - points[a].position;
    let rise = way.dot(ring.normal);
    if rise.abs() < 1.0e-3 * way.length() || rise == 0.0 {
        return Err(names.refused("is drawn along its own plane, or not at all".into()));
    }
    // the way leaves from the back of the first polygon
    if rise > 0.0 {
        ring.points.reverse();
        ring.normal = -ring.normal;
    }
    let mut body = Body::default();
    let first: Vec<DVec3> = ring.points.iter().map(|&i| points[i].position).map(|p| p + ring.off(p)).collect();
    let front: Vec<u32> = first.iter().map(|&p| body.vertex(p)).collect();
    let back: Vec<u32> = first.iter().map(|&p| body.vertex(p + way)).collect();
    let n = front.len();
    for i in 0..n {
        let next = (i + 1) % n;
        body.polygon(&[front[next], front[i], back[i], back[next]]);
    }
    if row.watertight {
        let far: Vec<u32> = back.iter().rev().copied().collect();
        if !body.polygon(&front) || !body.polygon(&far) {
            return Err(names.refused("could not be cut into triangles: do its sides cross?".into()));
        }
    }
    Ok(Fitted { edges, ..ring.fitted(body, names, points) })
}
