//! The interface of every shader as text: a change shows as a line in review.

use crate::common;
use std::fs;

/// `UPDATE_GOLDENS=1 cargo test --test files shader_interface` writes the file again.
#[test]
fn the_listing_of_all_interfaces_is_the_reviewed_one() {
    let path = common::root().join("tests/golden/interfaces.txt");
    let now = lucerna::shaders::LISTING;
    if std::env::var_os("UPDATE_GOLDENS").is_some() {
        fs::write(&path, now).unwrap();
        println!("wrote {}", path.display());
    }
    let golden = fs::read_to_string(&path).unwrap_or_default();
    let changed: Vec<String> = diff(&golden, now);
    assert!(
        golden == now,
        "shader interfaces changed; look at the lines below and run with UPDATE_GOLDENS=1 if they are meant:\n{}",
        changed.join("\n")
    );
}

/// Lines of only one side, marked − or +.
fn diff(old: &str, new: &str) -> Vec<String> {
    let (old, new): (Vec<&str>, Vec<&str>) = (old.lines().collect(), new.lines().collect());
    let gone = old.iter().filter(|l| !new.contains(l)).map(|l| format!("- {l}"));
    let come = new.iter().filter(|l| !old.contains(l)).map(|l| format!("+ {l}"));
    gone.chain(come).collect()
}

#[test]
fn every_shader_is_valid_spirv_with_a_sensible_interface() {
    assert!(!lucerna::shaders::ALL.is_empty());
    for shader in lucerna::shaders::ALL {
        for stage in shader.stages {
            assert_eq!(stage.spirv.len() % 4, 0, "{}", shader.name);
            assert_eq!(stage.spirv[..4], 0x0723_0203u32.to_le_bytes(), "{}", shader.name);
        }
        assert!(shader.push_size <= 128, "{}", shader.name);
        // The least that Vulkan 1.3 devices must offer; a shader over it would fail on some device first.
        assert!(shader.workgroup.iter().product::<u32>() <= 256, "{}: {:?}", shader.name, shader.workgroup);
        assert!(shader.color_outputs <= 8, "{}", shader.name);
    }
}
