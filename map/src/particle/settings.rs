//! Every number among the [`Parameters`] with its unit and its bounds.
//!
//! The bounds are wide: they keep out what makes no sense, not what merely follows badly.

use super::Parameters;
use sohle_shared::tracker::settings::Setting;

macro_rules! setting {
    ($name:literal, $unit:literal, $least:expr, $largest:expr, $($field:tt)+) => {
        Setting::new(
            $name,
            $unit,
            [$least, $largest],
            |parameters| parameters.$($field)+ as f32,
            |parameters, value| parameters.$($field)+ = value as _,
        )
    };
}

/// All of them.
pub const SETTINGS: &[Setting<Parameters>] = &[
    setting!("spacing_m", "m", 0.05, 10.0, spacing_m),
    setting!("headings", "1", 1.0, 360.0, headings),
    setting!("room_prior", "1", 0.0, 1.0, room_prior),
    setting!("most", "1", 10.0, 1e7, most),
    setting!("least", "1", 10.0, 1e6, least),
    setting!("phi.0", "m²", 0.0, 100.0, phi[0]),
    setting!("phi.1", "m²", 0.0, 100.0, phi[1]),
    setting!("phi.2", "rad²", 0.0, 100.0, phi[2]),
    setting!("psi.0", "m²", 0.0, 100.0, psi[0]),
    setting!("psi.1", "m²", 0.0, 100.0, psi[1]),
    setting!("psi.2", "rad²", 0.0, 100.0, psi[2]),
    setting!("phi_z_m", "m", 1e-3, 10.0, phi_z_m),
    setting!("cluster_m.0", "m", 0.1, 100.0, cluster_m[0]),
    setting!("cluster_m.1", "m", 0.1, 100.0, cluster_m[1]),
    setting!("cluster_most", "1", 0.0, 1e7, cluster_most),
    setting!("place_sigma_m", "m", 0.0, 10.0, place_sigma_m),
    setting!("turn_sigma", "rad", 0.0, 3.0, turn_sigma),
    setting!("turn_share", "1", 0.0, 10.0, turn_share),
    setting!("scale_sigma", "1", 0.0, 0.5, scale_sigma),
    setting!("scale_noise", "1", 0.0, 0.5, scale_noise),
    setting!("level_sigma_m", "m", 1e-3, 10.0, level_sigma_m),
    setting!("exit_sigma_m", "m", 1e-3, 10.0, exit_sigma_m),
    setting!("leak", "1", 1e-9, 0.5, leak),
    setting!("kld_error", "1", 0.005, 1.0, kld_error),
    setting!("resample_below", "1", 0.0, 1.0, resample_below),
    setting!("roughening", "1", 0.0, 2.0, roughening),
    setting!("lost_odds", "1", 1.0, 1e3, lost_odds),
    setting!("located_share", "1", 0.5, 1.0, located_share),
    setting!("located_sigma_m", "m", 0.01, 100.0, located_sigma_m),
    setting!("located_steps", "1", 0.0, 1e3, located_steps),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_number_of_a_file_is_a_setting_and_keeps_its_value() {
        let text = toml::to_string(&Parameters::default()).unwrap();
        let table: toml::Table = toml::from_str(&text).unwrap();
        let keys = table.iter().flat_map(|(key, value)| match value {
            toml::Value::Array(list) => (0..list.len()).map(|index| format!("{key}.{index}")).collect(),
            toml::Value::String(_) => Vec::new(),
            _ => vec![key.clone()],
        });
        let mut keys: Vec<String> = keys.collect();
        let mut names: Vec<&str> = SETTINGS.iter().map(|setting| setting.name).collect();
        keys.sort();
        names.sort_unstable();
        assert_eq!(names, keys);
        for setting in SETTINGS {
            let mut parameters = Parameters::default();
            setting.set(&mut parameters, setting.largest);
            assert_eq!(setting.value(&parameters), setting.largest, "{}", setting.name);
        }
    }

    #[test]
    fn each_is_checked_against_its_bounds() {
        for setting in SETTINGS {
            for outside in [setting.largest * 2.0 + 10.0, f32::NAN] {
                let mut parameters = Parameters::default();
                setting.set(&mut parameters, outside);
                // Whole numbers cannot be no number.
                if setting.value(&parameters).is_nan() || setting.value(&parameters) > setting.largest {
                    let told = parameters.check().unwrap_err().to_string();
                    assert!(told.contains(setting.name), "{told}");
                }
            }
        }
    }
}
