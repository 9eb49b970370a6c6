//! Balls in balls, whose volumes are known.

use super::*;

const TISSUES: Tissues = Tissues { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

/// A ball of so many rings, mm, facing outward.
fn ball(middle: Vec3, radius: f32, rings: usize) -> Vec<Triangle> {
    let at = |ring: usize, slice: usize| {
        let (t, p) = (
            ring as f32 / rings as f32 * std::f32::consts::PI,
            (slice % (2 * rings)) as f32 / rings as f32 * std::f32::consts::PI,
        );
        let out = match ring {
            0 => Vec3::Z,
            r if r == rings => Vec3::NEG_Z,
            _ => Vec3::new(t.sin() * p.cos(), t.sin() * p.sin(), t.cos()),
        };
        middle + out * radius
    };
    let mut triangles = Vec::new();
    for ring in 0..rings {
        for slice in 0..2 * rings {
            let [a, b] = [at(ring, slice), at(ring, slice + 1)];
            let [c, d] = [at(ring + 1, slice), at(ring + 1, slice + 1)];
            if ring > 0 {
                triangles.push([a, c, b]);
            }
            if ring + 1 < rings {
                triangles.push([b, c, d]);
            }
        }
    }
    triangles
}

fn turned(triangles: Vec<Triangle>) -> Vec<Triangle> {
    triangles.into_iter().map(|[a, b, c]| [a, c, b]).collect()
}

fn mm3_of(volume: &Volume, label: Label) -> f64 {
    volume.count(label) as f64 * volume.grid().voxel_mm3()
}

fn check(parts: &[Part], spacing: f32, tolerance: f64) -> Shaped {
    let shaped = voxelised(parts, spacing, None, &TISSUES).unwrap();
    for part in parts {
        let found = mm3_of(&shaped.volume, part.label);
        assert!((found / part.mm3 - 1.0).abs() < tolerance, "{:?}: {found} mm³ of {}", part.label, part.mm3);
    }
    shaped
}

#[test]
fn shells_in_shells_become_tissues_of_their_own_volumes() {
    let (up, down) = (Vec3::new(20.0, 30.0, 40.5), Vec3::new(20.0, 30.0, 40.0));
    let shells = [ball(up, 4.0, 40), ball(down, 3.0, 40), ball(down, 1.2, 40)].concat();
    let parts = nested(&[Label(1), Label(2), Label(3)], &shells).unwrap();
    assert!((parts[1].mm3 - 4.0 / 3.0 * std::f64::consts::PI * (27.0 - 1.728)).abs() < 1.0);
    let shaped = check(&parts, 0.1, 0.01);
    assert!(shaped.notes.is_empty(), "{:?}", shaped.notes);
    // However they face: a wall around a hollow is drawn facing inward by some.
    let shells = [ball(up, 4.0, 40), turned(ball(down, 3.0, 40)), ball(down, 1.2, 40)].concat();
    let again = nested(&[Label(1), Label(2), Label(3)], &shells).unwrap();
    assert_eq!(again[1].mm3, parts[1].mm3);
    assert_eq!(again[0].notes, ["a closed shell faced the wrong way and was turned inside out"]);
    let told = nested(&[Label(2), Label(3)], &shells).unwrap_err().to_string();
    assert!(told.contains("3 deep, and 2 tissues") && told.contains("--shells enamel,dentine,pulp"), "{told}");
}

#[test]
fn the_ramp_follows_the_exact_distance_and_passes_over_inner_surfaces() {
    // Aim: density is the distance's, and where enamel and dentine meet there is no seam. Method: a ball of two halves'
    // tissues, one a ball, the other a shell around it that shares its surface.
    let middle = Vec3::new(0.03, 0.01, -0.02);
    let inner = ball(middle, 2.5, 48);
    let shell = [ball(middle, 4.0, 64), turned(inner.clone())].concat();
    let parts = [part(Label(1), &shell).unwrap(), part(Label(2), &inner).unwrap()];
    assert!(parts[0].notes.is_empty() && parts[1].notes.is_empty());
    let volume = check(&parts, 0.2, 0.01).volume;
    let grid = volume.grid();
    // Its middle is no longer where it was: the crown's foot is.
    let sum: Vec3 =
        grid.cells().zip(volume.tissues()).filter(|(_, l)| *l != Label::AIR).map(|(c, _)| grid.centre(c)).sum();
    let middle = sum / (volume.count(Label(1)) + volume.count(Label(2))) as f32;
    for (index, cell) in grid.cells().enumerate() {
        let away = grid.centre(cell).distance(middle) - 4.0;
        let expected = ramp(away, volume.band()).unit();
        let found = volume.voxel(index).density.unit();
        assert!((found - expected).abs() < 0.03, "{away}: {found} for {expected}");
    }
}

#[test]
fn holes_are_refused_with_where_they_are_and_how_long() {
    let mut open = ball(Vec3::new(5.0, 6.0, 7.0), 4.0, 24);
    // The pole: 48 triangles around it.
    open.retain(|t| t.iter().all(|corner| corner.z < 10.999));
    let Unsound::Open { rims: 1, length, middle, is_loose: false } = part(Label(1), &open).unwrap_err() else {
        panic!("a hole")
    };
    let rim = 4.0 * (std::f32::consts::PI / 24.0).sin() * std::f32::consts::TAU;
    assert!((length / rim - 1.0).abs() < 0.01, "{length} of {rim}");
    assert!(middle.distance(Vec3::new(5.0, 6.0, 10.97)) < 0.05, "{middle}");
    let told = part(Label(1), &open).unwrap_err().to_string();
    assert!(told.contains("around (5.0, 6.0, 11.0) mm") && told.contains("Close Holes"), "{told}");
    // Every triangle by itself: no hole, but corners that were never joined.
    let loose: Vec<Triangle> = ball(Vec3::ZERO, 4.0, 6)
        .into_iter()
        .enumerate()
        .map(|(n, t)| t.map(|corner| corner + Vec3::splat(n as f32 * 1e-4)))
        .collect();
    assert!(part(Label(1), &loose).unwrap_err().to_string().contains("merge corners"));
}

#[test]
fn what_faces_the_wrong_way_is_turned_and_told() {
    let right = part(Label(1), &ball(Vec3::ZERO, 4.0, 20)).unwrap();
    let flipped = part(Label(1), &turned(ball(Vec3::ZERO, 4.0, 20))).unwrap();
    assert_eq!(flipped.mm3, right.mm3);
    assert_eq!(flipped.notes, ["a closed shell faced the wrong way and was turned inside out"]);
    let mut mixed = ball(Vec3::ZERO, 4.0, 20);
    mixed[17].swap(0, 1);
    mixed[99].swap(0, 2);
    let mixed = part(Label(1), &mixed).unwrap();
    assert!((mixed.mm3 / right.mm3 - 1.0).abs() < 1e-6);
    assert_eq!(mixed.notes, ["2 triangles faced another way than their neighbours and were turned"]);
}

#[test]
fn what_crosses_itself_doubles_edges_or_is_in_another_unit_is_refused_with_a_remedy() {
    let refused = |triangles: &[Triangle], parts: &[&str]| {
        let found = part(Label(1), triangles).and_then(|p| voxelised(&[p], 0.2, None, &TISSUES));
        let told = found.unwrap_err().to_string();
        parts.iter().for_each(|part| assert!(told.contains(part), "{part} in: {told}"));
    };
    let one = ball(Vec3::ZERO, 4.0, 20);
    refused(&[one.clone(), ball(Vec3::X * 5.0, 4.0, 20)].concat(), &["crosses itself", "Boolean Union"]);
    refused(&[one.clone(), one[..1].to_vec()].concat(), &["do not pair up", "Non Manifold"]);
    refused(&[], &["no triangles"]);
    refused(&[[Vec3::ZERO, Vec3::X, Vec3::NAN]], &["not a finite number"]);
    let scaled = |by: f32| one.iter().map(|t| t.map(|corner| corner * by)).collect::<Vec<_>>();
    refused(&scaled(0.001), &["longest side is 0.008 mm", "--unit m if"]);
    refused(&scaled(1000.0), &["--unit um"]);
    refused(&scaled(0.1), &["0.8 mm", "--unit cm"]);
    refused(&scaled(1e9), &["give the --unit"]);
    let whole = part(Label(1), &scaled(10.0)).unwrap();
    let too_fine = voxelised(std::slice::from_ref(&whole), 0.01, None, &TISSUES).unwrap_err().to_string();
    assert!(too_fine.contains("too many") && too_fine.contains("--spacing-mm"), "{too_fine}");
    let away = Some([Vec3::splat(100.0), Vec3::splat(120.0)]);
    assert!(voxelised(&[whole], 0.2, away, &TISSUES).unwrap_err().to_string().contains("reaches from"));
    // A strip that bites its own tail after half a turn.
    let strip: Vec<Triangle> = (0..40)
        .flat_map(|n| {
            let at = |n: usize, side: f32| {
                let t = n as f32 / 40.0 * std::f32::consts::TAU;
                let (sin, cos) = match n {
                    40 => (0.0, 1.0),
                    _ => (t.sin(), t.cos()),
                };
                // After the whole round the sides have changed places.
                let side = if n == 40 { -side } else { side };
                let half = if n == 40 { 0.0 } else { 0.5 * t };
                Vec3::new(cos, sin, 0.0) * (4.0 + side * half.cos()) + Vec3::Z * (side * half.sin())
            };
            [[at(n, 1.0), at(n, -1.0), at(n + 1, 1.0)], [at(n + 1, 1.0), at(n, -1.0), at(n + 1, -1.0)]]
        })
        .collect();
    refused(&strip, &["hole", "rim"]);
}

#[test]
fn slivers_between_shells_are_closed_and_chambers_are_told() {
    let middle = Vec3::ZERO;
    let shell = [ball(middle, 4.0, 48), turned(ball(middle, 3.0, 48))].concat();
    let gap = [part(Label(1), &shell).unwrap(), part(Label(2), &ball(middle, 2.97, 48)).unwrap()];
    let shaped = voxelised(&gap, 0.1, None, &TISSUES).unwrap();
    let empty_inside = shaped.volume.grid().cells().zip(shaped.volume.tissues()).filter(|(cell, label)| {
        *label == Label::AIR && shaped.volume.grid().centre(*cell).distance(middle + Vec3::Z * 4.0) < 3.9
    });
    assert_eq!(empty_inside.count(), 0);
    let hollow = voxelised(&gap[..1], 0.1, None, &TISSUES).unwrap();
    assert!(hollow.notes.iter().any(|note| note.contains("give a surface for the pulp")), "{:?}", hollow.notes);
}
