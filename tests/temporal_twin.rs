//! The pass of temporal anti-aliasing against a slow CPU implementation (twin), on random radiance over surfaces with edges, steps and background.

use crate::isr_lab::{Random, gbuffer_seen, image, read, scene, view};
use glam::{DVec2, DVec3, DVec4, IVec2, Vec2, dvec2, dvec3, ivec2, vec2};
use lucerna::{
    gpu::testing::with_gpu,
    graph::{Extent, Format, Graph},
    passes::temporal::{self, Settings},
    reference::isr_scene::{Buffers, Eye},
    scene::View,
    shaders::types,
};

type Texels = Vec<[f32; 4]>;

const SIZE: (usize, usize) = (45, 34);

fn extent() -> Extent {
    Extent::new(SIZE.0 as u32, SIZE.1 as u32)
}

fn color(texel: &[f32; 4]) -> DVec3 {
    DVec3::new(texel[0].into(), texel[1].into(), texel[2].into())
}

fn ycocg(c: DVec3) -> DVec3 {
    dvec3((c.x + 2.0 * c.y + c.z) / 4.0, (c.x - c.z) / 2.0, (2.0 * c.y - c.x - c.z) / 4.0)
}

fn rgb(c: DVec3) -> DVec3 {
    dvec3(c.x + c.y - c.z, c.x + c.z, c.x - c.y - c.z)
}

/// A frame with its surfaces. `view` is shifted.
struct Seen<'a> {
    view: View,
    buffers: &'a Buffers,
    fresh: &'a Texels,
}

/// The history.
struct Before<'a> {
    seen: Seen<'a>,
    average: &'a Texels,
    swing: &'a Texels,
}

impl Seen<'_> {
    fn size(&self) -> IVec2 {
        ivec2(self.buffers.width as i32, self.buffers.height as i32)
    }

    fn index(&self, at: IVec2) -> usize {
        let at = at.clamp(IVec2::ZERO, self.size() - 1);
        (at.y * self.size().x + at.x) as usize
    }

    fn uv(&self, at: IVec2) -> Vec2 {
        (at.as_vec2() + 0.5) / self.size().as_vec2()
    }

    fn place(&self, at: IVec2) -> DVec3 {
        self.view.world_from_depth(self.uv(at), self.buffers.depth[self.index(at)] as f32).as_dvec3()
    }

    fn normal(&self, at: IVec2) -> DVec3 {
        self.buffers.normal[self.index(at)].normalize_or_zero()
    }

    fn depth(&self, at: IVec2) -> f64 {
        self.buffers.depth[self.index(at)]
    }

    fn is_inside(&self, at: IVec2) -> bool {
        at.cmpge(IVec2::ZERO).all() && at.cmplt(self.size()).all()
    }
}

fn around(at: IVec2) -> impl Iterator<Item = IVec2> {
    (-1..=1).flat_map(move |y| (-1..=1).map(move |x| at + ivec2(x, y)))
}

/// Cubic convolution (Keys 1981) with a = −1/2, which is the spline of Catmull and Rom.
fn cubic(x: f64) -> f64 {
    let x = x.abs();
    match x {
        x if x < 1.0 => 1.5 * x.powi(3) - 2.5 * x.powi(2) + 1.0,
        x if x < 2.0 => -0.5 * x.powi(3) + 2.5 * x.powi(2) - 4.0 * x + 2.0,
        _ => 0.0,
    }
}

/// The average at a place between texels, and its number of frames.
fn recalled(before: &Before<'_>, at: DVec2) -> (DVec3, f64) {
    let (mut sum, mut low, mut high, mut count) = (DVec3::ZERO, DVec3::MAX, DVec3::ZERO, f64::MAX);
    let first = at.floor().as_ivec2();
    for y in -1..3 {
        for x in -1..3 {
            let off = (first + ivec2(x, y)).as_dvec2() - at;
            let value = &before.average[before.seen.index(first + ivec2(x, y))];
            sum += cubic(off.x) * cubic(off.y) * color(value);
            if off.abs().max_element() < 1.0 {
                (low, high) = (low.min(color(value)), high.max(color(value)));
                count = count.min(value[3].into());
            }
        }
    }
    (sum.clamp(low, high), count)
}

/// The blended radiance of a pixel with its number of frames, and its swing from frame to frame.
fn resolved(now: &Seen<'_>, motion: &Texels, before: &Before<'_>, most: f64, pixel: IVec2) -> (DVec4, DVec3) {
    let mut own = color(&now.fresh[now.index(pixel)]);
    let around_it: Vec<DVec3> = around(pixel).map(|at| ycocg(color(&now.fresh[now.index(at)]))).collect();
    let mean = around_it.iter().sum::<DVec3>() / 9.0;
    let deviation = around_it.iter().map(|c| (*c - mean) * (*c - mean)).sum::<DVec3>() / 9.0;
    let deviation = dvec3(deviation.x.sqrt(), deviation.y.sqrt(), deviation.z.sqrt());
    let mut front = pixel;
    for at in around(pixel).map(|at| at.clamp(IVec2::ZERO, now.size() - 1)) {
        if now.depth(at) < now.depth(front) {
            front = at;
        }
    }
    let alone = (own.extend(1.0), DVec3::ZERO);
    let (then, size) = (&before.seen, before.seen.size().as_dvec2());
    let sky = now.depth(front) >= 1.0;
    let moved = &motion[now.index(front)];
    let was = if moved[3] > 0.0 && !sky { color(moved) } else { now.place(front) };
    let clip = if sky {
        let ray = now.view.world_from_depth(now.uv(front), 1.0) - now.view.position;
        then.view.clip_from_world.as_dmat4() * ray.normalize().as_dvec3().extend(0.0)
    } else {
        then.view.clip_from_world.as_dmat4() * was.extend(1.0)
    };
    if clip.w <= 0.0 {
        return alone;
    }
    let seen = dvec2(0.5 + 0.5 * clip.x / clip.w, 0.5 - 0.5 * clip.y / clip.w) * size - 0.5;
    let (shift, old_shift) = (now.view.shift().as_dvec2(), then.view.shift().as_dvec2());
    let mut at = (pixel - front).as_dvec2() + seen + old_shift - shift;
    if (at - at.round()).abs().max_element() < 2e-3 {
        at = at.round();
    }
    if at.min_element() <= -0.5 || (at - size + 0.5).max_element() >= 0.0 || seen.min_element() < -1.0 {
        return alone;
    }
    let distance = then.view.axes()[2].as_dvec3().dot(was - then.view.position.as_dvec3());
    let visible = around((seen + 0.5).floor().as_ivec2()).filter(|at| then.is_inside(*at)).any(|texel| {
        let deep = then.depth(texel);
        let same = || {
            let n = then.normal(texel);
            n.dot(now.normal(front)) >= 0.9 && n.dot(then.place(texel) - was).abs() <= 0.02 * distance
        };
        deep >= 1.0 || (!sky && (deep * f64::from(then.view.far) > 1.02 * distance || same()))
    });
    if !visible {
        return alone;
    }
    let (average, count) = recalled(before, at);
    let mut average = ycocg(average);
    let nearest = then.index((at + 0.5).floor().as_ivec2());
    let moves = moved[3] > 0.0 && !sky;
    let mut swing = if moves { DVec3::ZERO } else { color(&before.swing[nearest]) };
    let mut count = (count + 1.0).min(most);
    let brightest = around(pixel).filter(|at| now.is_inside(*at) && *at != pixel);
    let brightest = brightest.map(|at| ycocg(color(&now.fresh[now.index(at)])).x).fold(0.0, f64::max);
    let limit = most * brightest.max(average.x);
    let luma = ycocg(own).x;
    if luma > limit {
        own *= limit / luma;
    }
    let half = (0.75 * deviation).max(4.0 * swing) + 0.02 * mean.x;
    let off = ((average - mean).abs() / half).max_element();
    if off > 1.0 {
        average = mean + (average - mean) / off;
        count = (count / off).max(1.0);
        swing /= off;
    }
    let last_fresh = &then.fresh[nearest];
    let step = ycocg(own) - color(last_fresh);
    // Of a step back, the part up to the size of the step before; little of it if the pixel shows the same surface as before.
    let before_it = f64::from(last_fresh[3]);
    let mut back = if step.x * before_it < 0.0 { (before_it / step.x).abs().min(1.0) } else { 0.0 };
    let there = (at + 0.5).floor().as_ivec2().clamp(IVec2::ZERO, then.size() - 1);
    let (sky_now, sky_then) = (now.depth(pixel) >= 1.0, then.depth(there) >= 1.0);
    let place = now.place(pixel);
    let distance = then.view.axes()[2].as_dvec3().dot(place - then.view.position.as_dvec3());
    let n = then.normal(there);
    let close = n.dot(now.normal(pixel)) >= 0.9 && n.dot(then.place(there) - place).abs() <= 0.001 * distance;
    if sky_now == sky_then && (sky_now || close) {
        back /= 16.0;
    }
    let square = swing * swing + (back * step * step - swing * swing) / count;
    swing = if moves { DVec3::ZERO } else { dvec3(square.x.sqrt(), square.y.sqrt(), square.z.sqrt()) };
    let past = rgb(average);
    ((past + (own - past) / count).max(DVec3::ZERO).extend(count), swing)
}

/// Fails if more than `most` of the texels are further than `slack` from the twin.
#[track_caller]
fn agree(found: &Texels, expected: &[DVec4], slack: f64, most: usize, what: &str) {
    let off = |i: &usize| {
        let far = |c: usize| (f64::from(found[*i][c]) - expected[*i][c]).abs() > slack * (1.0 + expected[*i][c].abs());
        (0..4).any(far)
    };
    let wrong: Vec<usize> = (0..found.len()).filter(off).collect();
    let first = wrong.first().map(|&i| (i, found[i], expected[i]));
    assert!(wrong.len() <= most, "{what}: {} of {} texels differ, the first {first:?}", wrong.len(), found.len());
}

#[test]
fn the_average_agrees_with_its_twin() {
    with_gpu(|gpu| {
        let (_, patches) = scene(SIZE.0, SIZE.1);
        let eye = Eye::look_at(dvec3(0.3, 1.2, 0.9), dvec3(0.0, 0.25, -1.3), 0.8, 10.0, SIZE.0, SIZE.1);
        let buffers = Buffers::cast(&eye, &patches, 1);
        let mut random = Random(17);
        let all = SIZE.0 * SIZE.1;
        // The camera has not moved, has moved, or has rotated.
        let eyes = [
            eye,
            Eye::look_at(dvec3(0.33, 1.16, 0.95), dvec3(0.02, 0.25, -1.3), 0.8, 10.0, SIZE.0, SIZE.1),
            Eye::look_at(dvec3(0.3, 1.2, 0.9), dvec3(0.3, 0.2, -1.3), 0.8, 11.0, SIZE.0, SIZE.1),
        ];
        for (turn, before) in eyes.iter().enumerate() {
            let mut then = Buffers::cast(before, &patches, 1);
            // A third of the surfaces faced another way, and a large nearer one hid some.
            for i in 0..all {
                let other = (then.normal[i] + 0.8 * random.vector()).normalize_or_zero();
                then.normal[i] = if random.next() < 0.33 { other } else { then.normal[i] };
                if (10..20).contains(&(i % SIZE.0)) && i / SIZE.0 > 8 {
                    (then.depth[i], then.normal[i]) = (0.05, dvec3(0.0, 0.0, 1.0));
                }
            }
            let mut texels = |scale: f32| -> Texels { (0..all).map(|_| random.texel().map(|v| scale * v)).collect() };
            let (mut fresh, old_fresh) = (texels(1.0), texels(1.0));
            let mut average = texels(0.6);
            let swing: Texels =
                texels(0.25).iter().map(|t| [t[0] + 0.02, 0.1 * t[1] + 0.05, 0.1 * t[2] + 0.05, 0.0]).collect();
            for (i, texel) in average.iter_mut().enumerate() {
                texel[3] = 1.0 + (i % 9) as f32;
            }
            // Some samples are very bright, in even surroundings and in others.
            for i in (0..all).step_by(37) {
                fresh[i] = [90.0, 80.0, 70.0, 1.0];
            }
            // A quarter of the pixels has moved, some of them within their own plane.
            let (now_shift, then_shift) = (vec2(0.25, -0.375), vec2(-0.125, 0.3125));
            let now = Seen { view: view(&eyes[0]).shifted(now_shift), buffers: &buffers, fresh: &fresh };
            let motion: Texels = (0..all)
                .map(|i| {
                    let at = ivec2((i % SIZE.0) as i32, (i / SIZE.0) as i32);
                    if random.next() >= 0.25 || buffers.depth[i] >= 1.0 {
                        return [0.0; 4];
                    }
                    let along = buffers.normal[i].any_orthonormal_vector() * (0.1 * random.next());
                    let off = random.vector() * 0.05 * f64::from(u8::from(random.next() < 0.5));
                    (now.place(at) + along + off).as_vec3().extend(1.0).to_array()
                })
                .collect();
            let seen = view(before).shifted(then_shift);
            let guides: Texels = (0..all)
                .map(|i| then.normal[i].normalize_or_zero().as_vec3().extend(then.depth[i] as f32).to_array())
                .collect();
            let old_ycocg: Texels =
                old_fresh.iter().map(|t| ycocg(color(t)).as_vec3().extend(t[3] - 0.5).to_array()).collect();

            let mut graph = Graph::new("temporal");
            graph.frame = 7;
            let g = gbuffer_seen(&mut graph, &now.view, &buffers);
            let frame = types::HistoryFrame { view: seen.uniform(), next: 7, shift: then_shift.to_array() };
            let past = temporal::Past {
                frame: graph.buffer_from("frame", &[frame]),
                average: image(&mut graph, "old", extent(), &average),
                guide: image(&mut graph, "old guide", extent(), &guides),
                fresh: image(&mut graph, "old fresh", extent(), &old_ycocg),
                swing: image(&mut graph, "old swing", extent(), &swing),
            };
            let motion_image = image(&mut graph, "motion", extent(), &motion);
            let fresh_image = image(&mut graph, "fresh", extent(), &fresh);
            let next = [
                ("average", Format::RGBA32F),
                ("guide", Format::RGBA32F),
                ("kept", Format::RGBA16F),
                ("swing", Format::RGBA16F),
            ]
            .map(|(name, format)| graph.image(name, format, extent()));
            let settings = Settings { frames: 6 };
            temporal::blend(&mut graph, &g, (motion_image, fresh_image), &past, next, now_shift, settings);
            let [blended, guide, kept, swings] = read(gpu, graph, next);

            let history = Before {
                seen: Seen { view: seen, buffers: &then, fresh: &old_ycocg },
                average: &average,
                swing: &swing,
            };
            let pixels = || (0..all).map(|i| ivec2((i % SIZE.0) as i32, (i / SIZE.0) as i32));
            let expected: Vec<_> = pixels().map(|pixel| resolved(&now, &motion, &history, 6.0, pixel)).collect();
            let wanted: Vec<DVec4> = expected.iter().map(|(e, _)| *e).collect();
            // Rounding decides about surfaces and places exactly at a threshold.
            agree(&blended, &wanted, 1e-3, 2 * all / 100, &format!("camera {turn}"));
            let wanted: Vec<DVec4> = expected.iter().map(|(_, s)| s.extend(0.0)).collect();
            agree(&swings, &wanted, 2e-3, 2 * all / 100, &format!("swing, camera {turn}"));
            let share = |of: &dyn Fn(f64) -> bool| expected.iter().filter(|(e, _)| of(e.w)).count();
            let (alone, limited, whole) = (
                share(&|n| n == 1.0),
                share(&|n| n > 1.0 && n.fract() != 0.0),
                share(&|n| n > 1.0 && n.fract() == 0.0),
            );
            println!("camera {turn}: {alone} alone, {limited} limited, {whole} whole");
            assert!(alone > 40 && limited > 100 && whole > 100, "{alone} {limited} {whole}");
            for i in 0..all {
                assert!((f64::from(guide[i][3]) - buffers.depth[i]).abs() < 1e-6, "depth {i}: {:?}", guide[i]);
                let bright = color(&fresh[i]).max_element() > 10.0;
                let own = ycocg(color(&fresh[i]));
                assert!(bright || (color(&kept[i]) - own).abs().max_element() < 1e-3, "fresh {i}: {:?}", kept[i]);
            }
        }
    });
}
