//! Shades of teeth: the colours that crowns and bare dentine have in the picture.
//!
//! Takes published CIE L*, a* and b*, read as for daylight (D65). Gives colours of a screen (sRGB).

use schemars::JsonSchema;
use serde::Deserialize;
use typodont_core::frame::Vec3;

/// Shade of the teeth: a tab of the VITA classical shade guide, or "of_age".
#[derive(Clone, Copy, Debug, PartialEq, Eq, Deserialize, JsonSchema)]
pub enum ToothShade {
    #[serde(rename = "A1")]
    A1,
    #[serde(rename = "A2")]
    A2,
    #[serde(rename = "A3")]
    A3,
    #[serde(rename = "A3.5")]
    A3Half,
    #[serde(rename = "A4")]
    A4,
    #[serde(rename = "B1")]
    B1,
    #[serde(rename = "B2")]
    B2,
    #[serde(rename = "B3")]
    B3,
    #[serde(rename = "B4")]
    B4,
    #[serde(rename = "C1")]
    C1,
    #[serde(rename = "C2")]
    C2,
    #[serde(rename = "C3")]
    C3,
    #[serde(rename = "C4")]
    C4,
    #[serde(rename = "D2")]
    D2,
    #[serde(rename = "D3")]
    D3,
    #[serde(rename = "D4")]
    D4,
    /// The mean shade at the patient's age.
    #[serde(rename = "of_age")]
    OfAge,
}

/// Colours of the tissues of a tooth, as "#rrggbb".
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct ShadeColours {
    pub enamel: String,
    pub dentine: String,
}

/// Difference between bare dentine and the tooth that it belongs to: darker and more chromatic. Chosen by eye so that both
/// are told apart in a cavity.
const DENTINE_BESIDE_TOOTH: Vec3 = Vec3::new(-5.0, 2.0, 12.0);

impl ToothShade {
    /// Colours of enamel as thick as on most of a crown, and of dentine. `age`: the patient's age, years.
    pub fn colours(self, age: f32) -> ShadeColours {
        let tooth = self.lab().unwrap_or_else(|| lab_of_age(age));
        ShadeColours { enamel: hex_of_lab(tooth), dentine: hex_of_lab(tooth + DENTINE_BESIDE_TOOTH) }
    }

    /// L*, a* and b* of the middle of the tab (O'Brien, Groh and Boenke, *A New, Small-Color-Difference Equation for Dental
    /// Shades*, Journal of Dental Research 69, 1990); `None` for the shade of an age.
    fn lab(self) -> Option<Vec3> {
        let [l, a, b] = match self {
            ToothShade::A1 => [79.57, -1.61, 13.05],
            ToothShade::A2 => [76.04, -0.08, 16.73],
            ToothShade::A3 => [75.36, 1.36, 19.61],
            ToothShade::A3Half => [72.31, 1.48, 21.81],
            ToothShade::A4 => [68.56, 1.58, 21.00],
            ToothShade::B1 => [78.90, -1.76, 12.33],
            ToothShade::B2 => [76.66, -1.62, 16.62],
            ToothShade::B3 => [74.13, 0.47, 22.34],
            ToothShade::B4 => [71.81, 0.50, 22.15],
            ToothShade::C1 => [74.29, -1.26, 12.56],
            ToothShade::C2 => [70.95, -0.22, 16.72],
            ToothShade::C3 => [68.83, -0.01, 16.68],
            ToothShade::C4 => [64.78, 1.59, 18.66],
            ToothShade::D2 => [75.27, -0.54, 13.47],
            ToothShade::D3 => [72.55, 0.62, 16.14],
            ToothShade::D4 => [71.99, -1.04, 17.77],
            ToothShade::OfAge => return None,
        };
        Some(Vec3::new(l, a, b))
    }
}

/// Mean colour of upper front teeth at an age, years: the line through the means of 20 to 29 and 40 to 49 years (Pustina Krasniqi
/// and others, Open Access Macedonian Journal of Medical Sciences 5, 2017), continued from 10 to 90 years. Measured in the mouth
/// with another instrument than the tabs, and lighter than these.
fn lab_of_age(age: f32) -> Vec3 {
    const YOUNG: (f32, Vec3) = (25.0, Vec3::new(83.2, -0.7, 21.7));
    const OLDER: (f32, Vec3) = (45.0, Vec3::new(79.4, -0.5, 23.9));
    let share = (age.clamp(10.0, 90.0) - YOUNG.0) / (OLDER.0 - YOUNG.0);
    YOUNG.1 + (OLDER.1 - YOUNG.1) * share
}

/// Colour of a screen, as "#rrggbb", for L*, a* and b* (IEC 61966-2-1; CIE 15). What a screen cannot show is clipped.
fn hex_of_lab(lab: Vec3) -> String {
    let fy = (lab.x + 16.0) / 116.0;
    let [x, y, z] = [fy + lab.y / 500.0, fy, fy - lab.z / 200.0].map(|f| {
        const LINEAR_UP_TO: f32 = 6.0 / 29.0;
        if f > LINEAR_UP_TO { f * f * f } else { 3.0 * LINEAR_UP_TO * LINEAR_UP_TO * (f - 4.0 / 29.0) }
    });
    let [x, z] = [x * 0.9505, z * 1.0888];
    let linear = [
        3.2406 * x - 1.5372 * y - 0.4986 * z,
        -0.9689 * x + 1.8758 * y + 0.0415 * z,
        0.0557 * x - 0.2040 * y + 1.0570 * z,
    ];
    let [red, green, blue] = linear.map(|v: f32| {
        let v = v.clamp(0.0, 1.0);
        let shown = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * libm::powf(v, 1.0 / 2.4) - 0.055 };
        (shown * 255.0 + 0.5) as u8
    });
    format!("#{red:02x}{green:02x}{blue:02x}")
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::catalog::parse_color;

    #[test]
    fn screen_colours_are_those_of_the_published_ones() {
        // Aim: known pairs: white, a middle grey and the sRGB red (CIE 15); bright teeth are lighter than dark ones.
        assert_eq!(hex_of_lab(Vec3::new(100.0, 0.0, 0.0)), "#ffffff");
        assert_eq!(hex_of_lab(Vec3::new(53.585, 0.0, 0.0)), "#808080");
        assert_eq!(hex_of_lab(Vec3::new(53.24, 80.09, 67.20)), "#ff0000");
        let green = |shade: ToothShade, age: f32| parse_color(&shade.colours(age).enamel).unwrap()[1];
        assert!(green(ToothShade::A1, 30.0) > green(ToothShade::A4, 30.0));
        assert!(green(ToothShade::OfAge, 15.0) > green(ToothShade::OfAge, 80.0) + 0.1);
        assert_eq!(ToothShade::B2.colours(15.0), ToothShade::B2.colours(80.0));
    }
}
