//! Any text as a `site.toml`.
#![no_main]

use heliodon_bundle::site::Site;
use libfuzzer_sys::fuzz_target;

fuzz_target!(|text: &str| {
    if let Ok(site) = Site::parse(text, "site.toml") {
        let again = Site::parse(&site.to_toml_string(), "site.toml").expect("the template of a valid site is valid");
        assert_eq!(again.file(), site.file());
    }
});
