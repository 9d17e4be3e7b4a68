//! Random graphs: are their plans right, is no barrier idle, and do they compute what a simulation on the CPU says?

use lucerna::{
    gpu::testing::with_gpu,
    graph::{testing::every_barrier_matters, *},
    shaders::{test::*, types::*},
};

/// Repeatable choices (xorshift64).
struct Dice(u64);

impl Dice {
    fn below(&mut self, end: usize) -> usize {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 % end as u64) as usize
    }
}

const LEVELS: usize = 2;
const LAYERS: usize = 2;
/// Words of a buffer; it is used in quarters of 64.
const WORDS: usize = 256;

/// A graph and what must come out of it.
struct Case {
    graph: Graph,
    images: Vec<(ImageRead, f32)>,
    buffers: Vec<(BufferRead, Vec<u32>)>,
}

/// The value of each part that has one, as the CPU sees it.
#[derive(Default)]
struct Model {
    images: Vec<(Image, [[Option<f32>; LAYERS]; LEVELS])>,
    buffers: Vec<(Buffer, [Option<u32>; 4])>,
}

fn case(seed: u64) -> Case {
    let mut dice = Dice(seed.wrapping_mul(0x9E37_79B9_7F4A_7C15) | 1);
    let mut graph = Graph::new("random");
    let mut model = Model::default();
    for i in 0..4 {
        let desc = ImageDesc::new(Format::RGBA32F, Extent::square(8)).layers(2).mips(2);
        model.images.push((graph.image_with(format!("image {i}"), desc), Default::default()));
        model.buffers.push((graph.buffer(format!("buffer {i}"), 4 * WORDS as u64), [None; 4]));
    }
    let mut case = Case { graph, images: Vec::new(), buffers: Vec::new() };
    for number in 0..24 {
        if dice.below(3) == 0 {
            buffer_pass(&mut case, &mut model, &mut dice, number)
        } else {
            image_pass(&mut case, &mut model, &mut dice, number)
        }
    }
    for (image, values) in &model.images {
        for (level, layer) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
            if let Some(value) = values[level][layer] {
                let part = image.mip(level as u32).layer(layer as u32);
                case.images.push((case.graph.read_image(part), value));
            }
        }
    }
    case
}

fn image_pass(case: &mut Case, model: &mut Model, dice: &mut Dice, number: u32) {
    let graph = &mut case.graph;
    let (from, to) = (dice.below(4), dice.below(4));
    let (level, layer, other) = (dice.below(LEVELS), dice.below(LAYERS), dice.below(LAYERS));
    let extent = Extent::square(8).mip(level as u32);
    let value = number as f32;
    let target = model.images[to].0;
    let part = target.mip(level as u32).layer(layer as u32);
    let source = model.images[from].0.mip(level as u32).layer(other as u32);
    let known = model.images[from].1[level][other];
    let apart = from != to || layer != other;
    let set = &mut model.images[to].1;
    match dice.below(9) {
        0 => {
            graph.clear(target, [value; 4]);
            *set = [[Some(value); LAYERS]; LEVELS];
        }
        1 => {
            graph.clear(target.layer(layer as u32), [value; 4]);
            set.iter_mut().for_each(|level| level[layer] = Some(value));
        }
        2 => {
            graph.compute(pattern::Args { image_out: part, push: pattern::Push { tag: value } }, extent);
            set[level][layer] = Some(value);
        }
        3 | 4 => {
            if let (Some(known), true) = (known, apart) {
                graph.compute(advance::Args { previous: source, next: part }, extent);
                set[level][layer] = Some(known + 1.0);
            }
        }
        5 => {
            if let (Some(known), true) = (known, apart) {
                graph.copy(source, part);
                set[level][layer] = Some(known);
            }
        }
        6 => {
            let load = match (set[level][layer], dice.below(3)) {
                (Some(_), 0) => Load::Keep,
                (_, 1) => Load::Clear([7.0; 4]),
                _ => Load::Discard,
            };
            let args = tint::Args { push: tint::Push { color: [value; 4] } };
            graph.raster(Targets::new().color(part, load), Raster::new(), args, Draw::fullscreen());
            set[level][layer] = Some(value);
        }
        7 => {
            if set[0].iter().all(Option::is_some) {
                graph.mips(target);
                set[1] = set[0];
            }
        }
        _ => {
            if let Some(known) = known {
                case.images.push((graph.read_image(source), known));
            }
        }
    }
}

fn buffer_pass(case: &mut Case, model: &mut Model, dice: &mut Dice, number: u32) {
    let graph = &mut case.graph;
    let (from, to) = (dice.below(4), dice.below(4));
    let (a, b) = (dice.below(4), dice.below(4));
    let quarter = |buffer: Buffer, q: usize| buffer.range(256 * q as u64..256 * (q as u64 + 1));
    let (source, target) = (quarter(model.buffers[from].0, a), quarter(model.buffers[to].0, b));
    let known = model.buffers[from].1[a];
    let apart = from != to || a != b;
    let whole = model.buffers[to].0;
    let set = &mut model.buffers[to].1;
    match (dice.below(6), known) {
        (0, _) => {
            graph.fill(whole, number);
            *set = [Some(number); 4];
        }
        (1, _) => {
            graph.compute(
                ramp::Args { values: target, push: ramp::Push { count: 64, first: number, step_size: 0 } },
                64,
            );
            set[b] = Some(number);
        }
        (2 | 3, Some(known)) if apart => {
            let bias = graph.uniform(&Bias { count: 64, bias: number });
            let args = twice::Args { values: source, values_out: target, bias, spec: twice::Spec::default() };
            graph.compute(args, 64);
            set[b] = Some(2 * known + number);
        }
        (4, Some(known)) if apart => {
            graph.copy_buffer(source, target);
            set[b] = Some(known);
        }
        (_, Some(known)) => case.buffers.push((graph.read_buffer(source), vec![known; 64])),
        _ => {}
    }
}

#[test]
fn plans_of_random_graphs_are_right_and_no_barrier_is_idle() {
    let mut barriers = 0;
    for seed in 0..400 {
        let case = case(seed);
        barriers += every_barrier_matters(&case.graph).barriers.len();
    }
    assert!(barriers > 10_000, "only {barriers} barriers were dropped: the graphs are too small");
}

#[test]
fn random_graphs_compute_what_a_simulation_says() {
    with_gpu(|gpu| {
        let mut runner = Runner::new(gpu);
        let mut checked = 0;
        for seed in 0..60 {
            let case = case(seed);
            let frame = runner.run(&case.graph).unwrap_or_else(|e| panic!("seed {seed}: {e}"));
            for (token, value) in &case.images {
                let pixels = frame.image(*token);
                assert!(pixels.to_f32().iter().all(|p| p[2] == *value), "seed {seed}, `{}`, {value}", pixels.name);
                checked += 1;
            }
            for (token, words) in &case.buffers {
                assert_eq!(frame.buffer::<u32>(*token), *words, "seed {seed}");
                checked += 1;
            }
        }
        assert!(checked > 300, "only {checked} values were compared");
    });
}
