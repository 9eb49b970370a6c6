//! Light on a surface: from the lamps and the surroundings, over the tissue and its coat of saliva, to the screen's colour.
//!
//! Takes lights, a finish and unit vectors of one space. Gives colours. Twin of `view.wgsl`. Uses no mathematics of the platform but
//! square roots, which are the same on every machine.

use crate::scene::{Appearance, Lights, Rgb};
use typodont_core::frame::{Vec3, smooth_step};

/// Light of the surroundings, as shares of the ambient light: from the opening of the mouth (above and toward the trainee;
/// a unit vector of world space), and from its depth, which is dark mucosa.
const OPENING: Vec3 = Vec3::new(0.0, 0.28, 0.96);
const BRIGHT: Vec3 = Vec3::new(1.30, 1.30, 1.28);
const DEEP: Vec3 = Vec3::new(0.42, 0.24, 0.20);
/// Gloss above which a surface mirrors the edge of the mouth's opening, and where that edge lies between the depth of the mouth
/// (0) and its opening (1).
const POLISHED: f32 = 0.5;
const EDGE: [f32; 2] = [0.35, 0.7];
/// Share of the light that hollows lose and their walls throw back, for a white wall: so fissures are warm, not grey.
const RETURNED: f32 = 0.75;
/// Share of the lamp's light that comes through a white tissue from around its shadow: enamel of 1 mm lets half of the light through,
/// so shadows on teeth and gingiva are neither black nor grey. The share is an estimate.
const SHADOW_GLOW: f32 = 0.33;
/// Brightness up to which the tone map changes nothing, and the rate at which brighter light turns white.
const LINEAR_UP_TO: f32 = 0.76;
const WHITENING: f32 = 0.15;

/// A place on a surface, as its light depends on it.
#[derive(Clone, Copy, Debug)]
pub struct LitPoint {
    pub point: Vec3,
    /// Outward, unit.
    pub normal: Vec3,
    /// Toward the eye, unit.
    pub to_eye: Vec3,
    /// Share of the light that reaches it out of hollows.
    pub open: f32,
}

impl Lights {
    /// Colour of a surface on the screen. `chair_share`: share of the chair lamp that the place sees, asked for only where that lamp
    /// shines.
    pub fn shade(&self, finish: Appearance, at: LitPoint, chair_share: impl Fn() -> f32) -> Rgb {
        tone(self.radiance(finish, at, chair_share)).to_array().map(f32::sqrt)
    }

    /// Light that leaves the surface toward the eye: what the coat of saliva mirrors, and what the tissue under it scatters.
    fn radiance(&self, finish: Appearance, at: LitPoint, chair_share: impl Fn() -> f32) -> Vec3 {
        let LitPoint { point, normal, to_eye, open } = at;
        let albedo = Vec3::from(finish.colour) * Vec3::from(finish.colour);
        let mirrored = coat_albedo(finish.gloss, normal.dot(to_eye).clamp(0.0, 1.0));
        // The mean over a hemisphere of a light that changes evenly is that from two thirds of the way.
        let mut light = self.surroundings(normal * 0.6667);
        let toward = normal * (2.0 * normal.dot(to_eye)) - to_eye;
        let mut shine = mirrored
            * match finish.gloss > POLISHED {
                true => self.mirrored_surroundings(toward),
                false => self.surroundings(toward),
            };
        for (lamp, is_chair) in [(&self.chair, true), (&self.head, false)] {
            let to_lamp = (lamp.position - point).normalize_or_zero();
            // Light spreads farther in a tissue the less of it is absorbed: red in gingiva. The total stays the same.
            let wrap = lamp.wrap * albedo;
            let beyond = Vec3::ONE + wrap;
            let scattered = ((Vec3::splat(normal.dot(to_lamp)) + wrap) / (beyond * beyond)).max(Vec3::ZERO);
            let seen = if is_chair && scattered != Vec3::ZERO { chair_share() } else { 1.0 };
            let colour = Vec3::from(lamp.colour) * lamp.strength;
            let glow = SHADOW_GLOW * albedo;
            light += colour * scattered * if seen < 1.0 { glow + seen * (Vec3::ONE - glow) } else { Vec3::ONE };
            shine += colour * seen * coat(finish.gloss, normal, to_lamp, to_eye);
        }
        let reached = open / (Vec3::ONE - RETURNED * albedo * (1.0 - open));
        albedo * light * reached * (1.0 - mirrored) + shine * open
    }

    /// Light of the surroundings from a direction; a shorter vector gives a blurred mean.
    fn surroundings(&self, toward: Vec3) -> Vec3 {
        self.surroundings_at(0.5 + 0.5 * toward.dot(OPENING))
    }

    /// Light of the surroundings as polished metal mirrors it: the opening of the mouth has an edge.
    fn mirrored_surroundings(&self, toward: Vec3) -> Vec3 {
        self.surroundings_at(smooth_step((0.5 + 0.5 * toward.dot(OPENING) - EDGE[0]) / (EDGE[1] - EDGE[0])))
    }

    /// Light of the surroundings between their depth (0) and the opening of the mouth (1).
    fn surroundings_at(&self, share: f32) -> Vec3 {
        self.ambient * (DEEP + (BRIGHT - DEEP) * share)
    }
}

/// Squared roughness of a coat: rougher where it is duller.
fn coat_width(gloss: f32) -> f32 {
    (0.42 - 1.6 * gloss).max(0.1)
}

/// Reflectance of a coat from straight above and at grazing incidence. Nothing that mirrors less than 2 % from above, as
/// water does, is a smooth dielectric: it mirrors less at grazing incidence, too (Lagarde and de Rousiers, *Moving
/// Frostbite to Physically Based Rendering*, 2014).
fn coat_reflectance(gloss: f32) -> [f32; 2] {
    let above = gloss * gloss;
    [above, (50.0 * above).min(1.0)]
}

/// Share of a uniform light that the coat mirrors toward an eye at this cosine: the integral of [`coat`], fitted from 6° of
/// grazing on for widths from 0.1 to 0.42. What is mirrored does not enter the tissue, so that no light is made or lost.
fn coat_albedo(gloss: f32, to_eye: f32) -> f32 {
    let a = coat_width(gloss);
    let x = 1.0 - to_eye;
    let x2 = x * x;
    let x3 = x2 * x;
    let above = 1.084 - 0.847 * a - x2 * (0.715 - 0.775 * a) - x2 * x3 * (0.197 - 1.784 * a);
    let grazing = x2 * x2 * (1.231 - 0.787 * x) + x3 * a * (2.207 * a - 1.829);
    let reflectance = coat_reflectance(gloss);
    reflectance[0] * above + reflectance[1] * grazing
}

/// Light that a coat mirrors from a lamp, multiplied by π: GGX (Walter and others, *Microfacet Models for Refraction through
/// Rough Surfaces*, 2007) with the visibility of Hammon, *PBR Diffuse Lighting for GGX+Smith Microsurfaces* (2017), and
/// Schlick's Fresnel term.
fn coat(gloss: f32, normal: Vec3, to_lamp: Vec3, to_eye: Vec3) -> f32 {
    let lamp_cosine = normal.dot(to_lamp);
    if lamp_cosine <= 0.0 {
        return 0.0;
    }
    let mix = |a: f32, b: f32, share: f32| a + (b - a) * share;
    let eye_cosine = normal.dot(to_eye).max(0.0);
    let halfway = (to_lamp + to_eye).normalize_or_zero();
    let half_cosine = normal.dot(halfway).max(0.0);
    let a = coat_width(gloss);
    let bulge = half_cosine * half_cosine * (a * a - 1.0) + 1.0;
    let facets = a * a / (bulge * bulge);
    let seen = 0.5 / mix(2.0 * lamp_cosine * eye_cosine, lamp_cosine + eye_cosine, a).max(1e-4);
    let x = 1.0 - to_lamp.dot(halfway).max(0.0);
    let x2 = x * x;
    let [above, grazing] = coat_reflectance(gloss);
    facets * seen * mix(above, grazing, x2 * x2 * x) * lamp_cosine
}

/// Tone map: colours brighter than a screen are compressed, and paler the brighter they are; others keep their hue, so that
/// shades of teeth can be compared (the shoulder of Khronos PBR Neutral, 2024).
fn tone(linear: Vec3) -> Vec3 {
    let peak = linear.max_element();
    if peak < LINEAR_UP_TO {
        return linear;
    }
    let left = 1.0 - LINEAR_UP_TO;
    let compressed = 1.0 - left * left / (peak + left - LINEAR_UP_TO);
    let pale = 1.0 - 1.0 / (WHITENING * (peak - compressed) + 1.0);
    let scaled = linear * (compressed / peak);
    scaled + (Vec3::splat(compressed) - scaled) * pale
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Lamp;

    /// Light that leaves the origin of a surface toward an eye, all of it lit by one lamp.
    fn radiance(chair: Lamp, finish: Appearance, normal: Vec3, to_eye: Vec3) -> Vec3 {
        shaded_radiance(chair, finish, normal, to_eye, 1.0)
    }

    /// The same where a share of the lamp is seen.
    fn shaded_radiance(chair: Lamp, finish: Appearance, normal: Vec3, to_eye: Vec3, seen: f32) -> Vec3 {
        let lights = Lights { ambient: 0.0, chair, head: Lamp::OFF };
        lights.radiance(finish, LitPoint { point: Vec3::ZERO, normal, to_eye, open: 1.0 }, || seen)
    }

    /// A direction at an angle from +z with this cosine.
    fn leaning(cosine: f32, turn: f32) -> Vec3 {
        let (sin, cos) = turn.sin_cos();
        let aside = (1.0 - cosine * cosine).sqrt();
        Vec3::new(aside * cos, aside * sin, cosine)
    }

    #[test]
    fn a_white_tissue_in_a_white_furnace_cannot_be_seen() {
        // Aim: the material makes no light and loses none: within 1 % from every side, from dull decay to enamel and
        // composite. Method: lamps of unit light from 200 000 directions around a white surface, which then is as bright as
        // the furnace.
        const RINGS: usize = 500;
        const TURNS: usize = 400;
        for gloss in [0.0, 0.02, 0.1, 0.15, 0.2, 0.3] {
            let white = Appearance { colour: [1.0; 3], gloss };
            for cosine in [0.1, 0.2, 0.4, 0.6, 0.8, 1.0] {
                let to_eye = leaning(cosine, 0.3);
                let mut sum = 0.0f64;
                for ring in 0..RINGS {
                    for turn in 0..TURNS {
                        let height = (ring as f32 + 0.5) / RINGS as f32 * 2.0 - 1.0;
                        let toward = leaning(height, (turn as f32 + 0.5) / TURNS as f32 * std::f32::consts::TAU);
                        // So far that all places are lit alike.
                        let chair = Lamp { position: toward * 1e6, strength: 1.0, ..Lamp::chair() };
                        sum += f64::from(radiance(chair, white, Vec3::Z, to_eye).y / chair.colour[1]);
                    }
                }
                // A lamp's light is multiplied by pi; the directions cover a sphere.
                let seen = sum * 4.0 / (RINGS * TURNS) as f64;
                assert!((seen - 1.0).abs() < 0.01, "gloss {gloss}, cosine {cosine}: {seen}");
            }
        }
    }

    #[test]
    fn nothing_burns_to_flat_white_and_the_dark_keeps_its_form() {
        // Aim: two places of different brightness differ on the screen. Method: the tone map rises everywhere, up to eight
        // times white, stays under white, and leaves what is not bright as it is.
        let mut before = Vec3::splat(-1e-6);
        for step in 0..=800 {
            let linear = Vec3::new(1.0, 0.9, 0.8) * (0.01 * step as f32);
            let now = tone(linear);
            assert!(now.cmpgt(before).all() && now.max_element() < 1.0, "{linear}: {now} after {before}");
            assert!(linear.x >= LINEAR_UP_TO || now == linear, "{linear}: {now}");
            before = now;
        }
    }

    #[test]
    fn shadows_glow_on_pale_tissue_and_are_dark_on_dark_tissue() {
        // Aim: in the lamp's shadow, white tissue keeps the share that comes through it, black none, and neither shines.
        let lamp = Lamp { position: Vec3::Z * 1e6, wrap: 0.0, ..Lamp::chair() };
        let share = |grey: f32, gloss: f32| {
            let [light, shadow] = [1.0, 0.0].map(|seen| {
                shaded_radiance(lamp, Appearance { colour: [grey; 3], gloss }, Vec3::Z, leaning(0.7, 0.0), seen).y
            });
            shadow / light
        };
        assert!((share(1.0, 0.0) - SHADOW_GLOW).abs() < 1e-3, "white: {}", share(1.0, 0.0));
        assert!(share(0.2, 0.0) < 0.02, "dark: {}", share(0.2, 0.0));
        let mirrored = shaded_radiance(lamp, Appearance { colour: [0.0; 3], gloss: 0.6 }, Vec3::Z, Vec3::Z, 0.0);
        assert_eq!(mirrored, Vec3::ZERO, "a mirror in the shadow");
    }

    #[test]
    fn light_reaches_farther_into_red_tissue_in_red() {
        // Aim: the shaded side of gingiva is redder than the lit side, since red light scatters farthest in it.
        let gum = Appearance { colour: [0.85, 0.53, 0.50], gloss: 0.0 };
        let lamp = Lamp { position: Vec3::Z * 1e6, ..Lamp::chair() };
        let red_share = |cosine: f32| {
            let seen = radiance(lamp, gum, leaning(cosine, 0.0), Vec3::Z);
            seen.x / (seen.x + seen.y + seen.z)
        };
        assert!(red_share(0.02) > red_share(0.9) + 0.05, "{} {}", red_share(0.02), red_share(0.9));
    }
}
