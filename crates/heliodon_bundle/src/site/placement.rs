//! How a site's words for unit, axes and place become the placement of a mesh.

use super::{Actor, Part, UpAxis};
use heliodon_mesh::place::{Placement, Up};

impl From<UpAxis> for Up {
    fn from(axis: UpAxis) -> Self {
        match axis {
            UpAxis::Y => Self::Y,
            UpAxis::Z => Self::Z,
        }
    }
}

impl Part {
    /// `site_from_file`: where the part's files stand in the bundle's space, `origin` being the site's.
    #[must_use]
    pub fn placement(&self, origin: [f64; 3]) -> Placement {
        Placement {
            unit: self.unit,
            up: self.up.into(),
            scale: [self.scale; 3],
            rotate_deg: self.rotate_deg,
            translate: self.translate,
            origin,
        }
    }
}

impl Actor {
    /// `figure_from_file`: the model in metres, +Y up, about its own origin, before it is turned along its path and carried to where it is.
    #[must_use]
    pub fn placement(&self) -> Placement {
        Placement {
            unit: self.unit,
            up: self.up.into(),
            scale: [self.scale; 3],
            rotate_deg: self.rotate_deg,
            ..Placement::default()
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::site::Unit;
    use glam::DVec3;

    #[test]
    fn parts_and_actors_are_placed_by_the_same_steps() {
        let text = "[site]\nname = \"a\"\n[[part]]\nfile = \"a.ply\"\nunit = \"cm\"\nup = \"z\"\nscale = -2\nrotate_deg = [0, 90, 0]\n\
                    translate = [1, 2, 3]\n[sky]\nprobes = \"a.hdr\"\nmapping = \"lat-long\"\n";
        let site = super::super::Site::parse(text, "site.toml").unwrap();
        let part = &site.parts[0];
        let actor = Actor {
            unit: Unit::Centimetre,
            up: UpAxis::Z,
            scale: -2.0,
            rotate_deg: [0.0, 90.0, 0.0],
            ..Actor::at("a.ply", [9.0, 9.0, 9.0])
        };
        let of_part = part.placement([10.0, 0.0, 0.0]).affine().unwrap();
        let of_actor = actor.placement().affine().unwrap();
        // (100, 200, 300) cm -> (1, 3, -2) m -> (-2, -6, 4) -> about Y: (4, -6, 2)
        let place = DVec3::new(100.0, 200.0, 300.0);
        assert!(
            of_actor.position(place).distance(DVec3::new(4.0, -6.0, 2.0)) < 1e-12,
            "an actor's own place is not among them"
        );
        assert!(of_part.position(place).distance(DVec3::new(-5.0, -4.0, 5.0)) < 1e-12);
    }
}
