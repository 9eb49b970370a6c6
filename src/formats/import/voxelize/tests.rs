//! Nested balls, whose volumes are known.

use super::*;

const TISSUES: TissueLabels = TissueLabels { enamel: Label(1), dentine: Label(2), pulp: Label(3) };

/// A ball with `rings` rings of triangles, facing outward; lengths in mm.
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

fn check(parts: &[TissueSurface], spacing: f32, tolerance: f64) -> Voxelized {
    let shaped = voxelize(parts, spacing, None, &TISSUES).unwrap();
    for part in parts {
        let found = mm3_of(&shaped.volume, part.label);
        assert!(
            (found / part.volume_mm3 - 1.0).abs() < tolerance,
            "{:?}: {found} mm³ of {}",
            part.label,
            part.volume_mm3
        );
    }
    shaped
}

#[test]
fn shells_in_shells_become_tissues_of_their_own_volumes() {
    let (up, down) = (Vec3::new(20.0, 30.0, 40.5), Vec3::new(20.0, 30.0, 40.0));
    let shells = [ball(up, 4.0, 40), ball(down, 3.0, 40), ball(down, 1.2, 40)].concat();
    let parts = nested_tissue_surfaces(&[Label(1), Label(2), Label(3)], &shells).unwrap();
    assert!((parts[1].volume_mm3 - 4.0 / 3.0 * std::f64::consts::PI * (27.0 - 1.728)).abs() < 1.0);
    let shaped = check(&parts, 0.1, 0.01);
    assert!(shaped.notes.is_empty(), "{:?}", shaped.notes);
    // Orientation does not matter: some programs draw the wall around a hollow facing inward.
    let shells = [ball(up, 4.0, 40), turned(ball(down, 3.0, 40)), ball(down, 1.2, 40)].concat();
    let again = nested_tissue_surfaces(&[Label(1), Label(2), Label(3)], &shells).unwrap();
    assert_eq!(again[1].volume_mm3, parts[1].volume_mm3);
    assert_eq!(again[0].notes, ["a closed shell faced the wrong way and was turned inside out"]);
    let message = nested_tissue_surfaces(&[Label(2), Label(3)], &shells).unwrap_err().to_string();
    assert!(
        message.contains("nested 3 deep, and 2 tissues") && message.contains("--shells enamel,dentine,pulp"),
        "{message}"
    );
}

#[test]
fn the_ramp_follows_the_exact_distance_and_passes_over_inner_surfaces() {
    // Aim: density follows from the distance to the outer surface, without a seam where enamel and dentine meet.
    // Method: a ball of dentine within a shell of enamel that shares its surface.
    let middle = Vec3::new(0.03, 0.01, -0.02);
    let inner = ball(middle, 2.5, 48);
    let shell = [ball(middle, 4.0, 64), turned(inner.clone())].concat();
    let parts = [tissue_surface(Label(1), &shell).unwrap(), tissue_surface(Label(2), &inner).unwrap()];
    assert!(parts[0].notes.is_empty() && parts[1].notes.is_empty());
    let volume = check(&parts, 0.2, 0.01).volume;
    let grid = volume.grid();
    // The origin is no longer at the ball's middle: it is at the foot of the crown.
    let sum: Vec3 =
        grid.cells().zip(volume.tissues()).filter(|(_, l)| *l != Label::AIR).map(|(c, _)| grid.centre(c)).sum();
    let middle = sum / (volume.count(Label(1)) + volume.count(Label(2))) as f32;
    for (index, cell) in grid.cells().enumerate() {
        let away = grid.centre(cell).distance(middle) - 4.0;
        let expected = density_at_distance(away, volume.half_band()).unit();
        let found = volume.voxel(index).density.unit();
        assert!((found - expected).abs() < 0.03, "{away}: {found} for {expected}");
    }
}

#[test]
fn holes_are_refused_with_their_position_and_length() {
    let mut open = ball(Vec3::new(5.0, 6.0, 7.0), 4.0, 24);
    // The pole: 48 triangles around it.
    open.retain(|t| t.iter().all(|corner| corner.z < 10.999));
    let VoxelizeError::Open { rims: 1, length, middle, is_loose: false } = tissue_surface(Label(1), &open).unwrap_err()
    else {
        panic!("a hole")
    };
    let rim = 4.0 * (std::f32::consts::PI / 24.0).sin() * std::f32::consts::TAU;
    assert!((length / rim - 1.0).abs() < 0.01, "{length} of {rim}");
    assert!(middle.distance(Vec3::new(5.0, 6.0, 10.97)) < 0.05, "{middle}");
    let message = tissue_surface(Label(1), &open).unwrap_err().to_string();
    assert!(message.contains("around (5.0, 6.0, 11.0) mm") && message.contains("Close Holes"), "{message}");
    // Every triangle separate: not a hole, but corners that were never joined.
    let loose: Vec<Triangle> = ball(Vec3::ZERO, 4.0, 6)
        .into_iter()
        .enumerate()
        .map(|(n, t)| t.map(|corner| corner + Vec3::splat(n as f32 * 1e-4)))
        .collect();
    assert!(tissue_surface(Label(1), &loose).unwrap_err().to_string().contains("merge corners"));
}

#[test]
fn shells_that_face_the_wrong_way_are_flipped_with_a_note() {
    let right = tissue_surface(Label(1), &ball(Vec3::ZERO, 4.0, 20)).unwrap();
    let flipped = tissue_surface(Label(1), &turned(ball(Vec3::ZERO, 4.0, 20))).unwrap();
    assert_eq!(flipped.volume_mm3, right.volume_mm3);
    assert_eq!(flipped.notes, ["a closed shell faced the wrong way and was turned inside out"]);
    let mut mixed = ball(Vec3::ZERO, 4.0, 20);
    mixed[17].swap(0, 1);
    mixed[99].swap(0, 2);
    let mixed = tissue_surface(Label(1), &mixed).unwrap();
    assert!((mixed.volume_mm3 / right.volume_mm3 - 1.0).abs() < 1e-6);
    assert_eq!(mixed.notes, ["2 triangles were oriented differently from their neighbours and were flipped"]);
}

#[test]
fn surfaces_that_cross_themselves_double_edges_or_use_another_unit_are_refused_with_a_remedy() {
    let refused = |triangles: &[Triangle], parts: &[&str]| {
        let found = tissue_surface(Label(1), triangles).and_then(|p| voxelize(&[p], 0.2, None, &TISSUES));
        let message = found.unwrap_err().to_string();
        parts.iter().for_each(|part| assert!(message.contains(part), "{part} in: {message}"));
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
    let whole = tissue_surface(Label(1), &scaled(10.0)).unwrap();
    let too_fine = voxelize(std::slice::from_ref(&whole), 0.01, None, &TISSUES).unwrap_err().to_string();
    assert!(too_fine.contains("too many") && too_fine.contains("--spacing-mm"), "{too_fine}");
    let away = Some(Aabb::new(Vec3::splat(100.0), Vec3::splat(120.0)));
    assert!(voxelize(&[whole], 0.2, away, &TISSUES).unwrap_err().to_string().contains("extends from"));
    // A strip that closes on itself after half a twist.
    let strip: Vec<Triangle> = (0..40)
        .flat_map(|n| {
            let at = |n: usize, side: f32| {
                let t = n as f32 / 40.0 * std::f32::consts::TAU;
                let (sin, cos) = match n {
                    40 => (0.0, 1.0),
                    _ => (t.sin(), t.cos()),
                };
                // After the whole round the two sides have changed places.
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
fn slivers_between_shells_are_closed_and_chambers_are_noted() {
    let middle = Vec3::ZERO;
    let shell = [ball(middle, 4.0, 48), turned(ball(middle, 3.0, 48))].concat();
    let gap = [tissue_surface(Label(1), &shell).unwrap(), tissue_surface(Label(2), &ball(middle, 2.97, 48)).unwrap()];
    let shaped = voxelize(&gap, 0.1, None, &TISSUES).unwrap();
    let empty_inside = shaped.volume.grid().cells().zip(shaped.volume.tissues()).filter(|(cell, label)| {
        *label == Label::AIR && shaped.volume.grid().centre(*cell).distance(middle + Vec3::Z * 4.0) < 3.9
    });
    assert_eq!(empty_inside.count(), 0);
    let hollow = voxelize(&gap[..1], 0.1, None, &TISSUES).unwrap();
    assert!(hollow.notes.iter().any(|note| note.contains("give a surface for the pulp")), "{:?}", hollow.notes);
}
