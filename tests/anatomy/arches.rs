//! Both dental arches, measured as on plaster: a caliper on the surfaces of the teeth that are made, where they stand.

use typodont_anatomy::jaw::Jaw;
use typodont_anatomy::{TissueLabels, grid_of_spacing, grow, teeth};
use typodont_core::frame::{Pose, Vec3};
use typodont_core::touch::ClosedMesh;
use typodont_core::volume::{Label, surface};
use typodont_exercise::catalog::TissueTable;
use typodont_formats::Library;
use typodont_scene::StandaloneJaw;

const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

/// A tooth where it stands: its surface in tooth space.
struct Standing {
    fdi: u8,
    places: Vec<Vec3>,
    obstacle: ClosedMesh,
    arch_from_tooth: Pose,
}

impl Standing {
    fn crown(&self) -> f32 {
        teeth::tooth(self.fdi).unwrap().sizes.crown
    }

    /// The highest of some places, arch space.
    fn highest(&self, is_meant: impl Fn(Vec3) -> bool) -> Vec3 {
        let places = self.places.iter().filter(|p| is_meant(**p));
        self.arch_from_tooth * *places.max_by(|a, b| a.z.total_cmp(&b.z)).unwrap()
    }

    /// The middle of the cheek's or the lip's face of the crown (Andrews's facial-axis point), arch space.
    fn facial_axis_point(&self) -> Vec3 {
        let near = self.places.iter().filter(|p| (p.z - 0.5 * self.crown()).abs() < 0.3 && p.y.abs() < 0.4);
        self.arch_from_tooth * *near.max_by(|a, b| a.x.total_cmp(&b.x)).unwrap()
    }
}

/// One half of a jaw, grown.
fn half(jaw: Jaw, quadrant: u8) -> Vec<Standing> {
    let table = TissueTable::read(&Library::shipped()).unwrap();
    let StandaloneJaw { teeth: standing, .. } = StandaloneJaw::new(jaw, None, &table);
    let standing = standing.into_iter().filter(|(fdi, _)| fdi / 10 == quadrant);
    let grown = standing.map(|(fdi, arch_from_tooth)| {
        let form = teeth::tooth(fdi).unwrap();
        let mesh = surface::extract(&grow(&form, grid_of_spacing(&form, 0.15), &TISSUES));
        let obstacle = ClosedMesh::new(&mesh).unwrap();
        Standing { fdi, places: mesh.positions, obstacle, arch_from_tooth }
    });
    grown.collect()
}

#[test]
fn arches_are_as_wide_as_measured_and_as_deep_as_their_teeth_allow() {
    // Aim: widths between the canines' tips and between the first molars' facial-axis points within 5 % of published means: canines 34
    // and 26 mm (34.2 in Bonakdarchian and Ghorbanipour, 2010; 35.5 and 26.7 in Akdemir and others, 2022); molars 57.9 and 54.2 mm (Mina
    // and others, 2017). Depth from the incisors' edges to the molars' facial-axis points: 31.6 and 28.1 mm there, held to 19 %, for their
    // teeth were wider than the table's: six upper front teeth of the table measure 45 mm, of Bonakdarchian's people 48.2 mm.
    for (jaw, quadrant, canines, molars, depth) in
        [(Jaw::Upper, 1, 34.0, 57.9, 31.6), (Jaw::Lower, 3, 26.0, 54.2, 28.1)]
    {
        let teeth = half(jaw, quadrant);
        let edge =
            teeth[0].places.iter().filter(|p| p.z > teeth[0].crown() - 0.4).map(|p| teeth[0].arch_from_tooth * *p);
        let edge = edge.map(|p| p.y).fold(f32::INFINITY, f32::min);
        let (canine, molar) = (teeth[2].highest(|_| true), teeth[5].facial_axis_point());
        println!("{jaw:?}: canines {:.1} mm apart, {:.1} mm behind the edges", 2.0 * canine.x, canine.y - edge);
        println!("{jaw:?}: first molars {:.1} mm apart, {:.1} mm behind the edges", 2.0 * molar.x, molar.y - edge);
        for (what, found, wanted, share) in [
            ("between the canines", 2.0 * canine.x, canines, 0.05),
            ("between the first molars", 2.0 * molar.x, molars, 0.05),
            ("depth at the first molars", molar.y - edge, depth, 0.19),
        ] {
            assert!((found / wanted - 1.0).abs() < share, "{jaw:?}, {what}: {found} mm, not {wanted}");
        }
    }
}

#[test]
fn no_tooth_of_a_jaw_overlaps_another() {
    // Aim: neighbours touch, and none reaches more than a tenth of a millimetre into another, roots and all. Method: every corner of each
    // surface against the next tooth's, and of the first against the plane between the twins.
    for (jaw, quadrant) in [(Jaw::Upper, 1), (Jaw::Lower, 3)] {
        let teeth = half(jaw, quadrant);
        for pair in teeth.windows(2) {
            let least = |from: &Standing, to: &Standing| {
                let to_from = to.arch_from_tooth.inverse() * from.arch_from_tooth;
                let away = from.places.iter().map(|p| to.obstacle.distance(to_from * *p));
                away.fold(f32::INFINITY, f32::min)
            };
            let gap = least(&pair[0], &pair[1]).min(least(&pair[1], &pair[0]));
            println!("{} and {}: {gap:.3} mm", pair[0].fdi, pair[1].fdi);
            assert!((-0.1..0.25).contains(&gap), "{} and {}: {gap} mm", pair[0].fdi, pair[1].fdi);
        }
        let least = teeth[0].places.iter().map(|p| (teeth[0].arch_from_tooth * *p).x).fold(f32::INFINITY, f32::min);
        assert!((-0.05..0.15).contains(&least), "{jaw:?}: the twins are {} mm apart", 2.0 * least);
    }
}
