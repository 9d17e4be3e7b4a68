//! What stands in the windows: mullions and tracery of stone, bars of iron. There are no panes: glass would stop the light of
//! techniques that know no transmission.

use super::super::kit::{Geometry, Model, bevel_box, loop_sweep, slab, sweep};
use super::{Palette, walls::Arch};
use glam::{Vec2, Vec3, vec2};
use std::f32::consts::TAU;

/// A square bar, `half` its half width.
fn bar(half: f32) -> [Vec2; 4] {
    [vec2(-half, -half), vec2(half, -half), vec2(half, half), vec2(-half, half)]
}

fn path(points: &[Vec2]) -> Vec<Vec3> {
    points.iter().map(|p| p.extend(0.0)).collect()
}

/// Frame, tracery and iron in the plane z = 0 of a window, and a sloped sill towards +Z. `levels` is how often the light is
/// halved, `thin` half the width of the finest bars.
pub(super) fn window(palette: &Palette, arch: &Arch, levels: u32, thin: f32) -> Model {
    // The frame sinks half into the jambs.
    let mut stone = sweep(&path(&arch.outline(18)), &bar(2.0 * thin), false, |_| 1.0);
    tracery(&mut stone, arch, levels, thin);
    let sill = bevel_box(2.0 * arch.half - 0.01, 0.06, 0.5, 0.01).turned_x(14.0);
    stone.append(&sill.at(arch.middle, arch.bottom + 0.05, 0.26));
    let mut iron = Geometry::default();
    let count = ((arch.spring - arch.bottom) / 0.62) as usize;
    for i in 1..=count {
        let y = arch.bottom + (arch.spring - arch.bottom) * i as f32 / (count + 1) as f32;
        iron.append(&slab([arch.middle - arch.half, y - 0.011, -0.011], [arch.middle + arch.half, y + 0.011, 0.011]));
    }
    let mut model = Model::of(palette.stone, stone);
    model.add(palette.iron, iron);
    model
}

fn tracery(out: &mut Geometry, arch: &Arch, levels: u32, thin: f32) {
    if levels == 0 {
        return;
    }
    let half = 0.5 * arch.half;
    let width = thin * (1.0 + 0.4 * (levels - 1) as f32);
    // The mullion ends where the small arches meet above it.
    let foot = vec2(arch.middle, arch.bottom);
    out.append(&sweep(&path(&[foot, vec2(arch.middle, arch.spring + 0.02)]), &bar(width), false, |_| 1.0));
    for side in [-1.0, 1.0] {
        let light = Arch { middle: arch.middle + side * half, half, ..*arch };
        let outline = light.outline(14);
        out.append(&sweep(&path(&outline[1..outline.len() - 1]), &bar(0.9 * width), false, |_| 1.0));
        tracery(out, &light, levels - 1, thin);
    }
    // The circle that touches the arch and both lights, and four lobes in it.
    let (radius, rise) = (arch.half / 3.0, 2.0 * arch.half / 3.0);
    let ring = |radius: f32| -> Vec<Vec3> {
        (0..22).map(|i| (Vec2::from_angle(TAU * i as f32 / 22.0) * radius).extend(0.0)).collect()
    };
    let (x, y) = (arch.middle, arch.spring + rise);
    out.append(&loop_sweep(&ring(radius), &bar(0.95 * width), false).at(x, y, 0.0));
    if radius > 0.2 {
        for i in 0..4 {
            let lobe = Vec2::from_angle(TAU * i as f32 / 4.0) * radius * 0.52;
            let small = loop_sweep(&ring(radius * 0.4), &bar(0.45 * width), false);
            out.append(&small.at(x + lobe.x, y + lobe.y, 0.0));
        }
    }
}
