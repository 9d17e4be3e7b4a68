use super::*;
use crate::scene::texture::bc7;

/// BasisLZ global data of a picture of 24×20 texels with alpha, made by the encoder of the format's authors (basisu 1.16).
const GLOBAL: &str = "\
    300024008000000070000000420000000000000000000000000000001600000016000000200000002040dc8001000401585d4cf002ac0220c0c38001\
    100661b48d728026ba150608103960008041106863dca02f8413019802000000000081b2603b924b42b2ee66fbcc44120024ebee81929c9900b693f4\
    cc443e9db96eaea35ef01677d3486138c61ef978e50e9ad100c7e1b8bc78e43ebc82460a301ff95dc37298665ad1a4000008e6060c01611400e0eff1\
    2391237768256a9d4ef944f40a63286f0023b081426d051731805d0c00a8802af598ef5cd0ab2b61b56d2eea45cc9be6ba1e52c480c8807ea4a40391\
    84d8070a95ec30902594d9e1fe9a4cfb5ab01c69f9a22ebb232addc67f7a7b900da5e6731affce4f01c184000100000010f47f74240c304b40008060\
    0080b612f99253506c4f09782b3100c22074d0b83998188f681c941286c706fd027a18004c000000000000208000\
";

/// Its slices: colour, then alpha.
const LEVEL: &str = "\
    9b85c280600921af245954033721d089a660c48d0cacefeb9f487e8abd625844b6b477c4ddff40e4633a5d95defce021538b49795b03\
";

fn bytes(hexadecimal: &str) -> Vec<u8> {
    hexadecimal
        .as_bytes()
        .chunks(2)
        .map(|pair| u8::from_str_radix(str::from_utf8(pair).unwrap(), 16).unwrap())
        .collect()
}

/// FNV-1a over all texels.
fn digest(texels: &[[u8; 4]]) -> u64 {
    let step = |hash: u64, byte: &u8| (hash ^ u64::from(*byte)).wrapping_mul(0x100_0000_01b3);
    texels.as_flattened().iter().fold(0xcbf2_9ce4_8422_2325, step)
}

/// Numbers below 2^31, the same in every run.
fn random() -> impl FnMut() -> usize {
    let mut state = 1u64;
    move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 33) as usize
    }
}

/// The digests are of the texels that the authors' C++ transcoder (1.16) made of the same bytes.
#[test]
fn texels_are_those_of_the_reference_transcoder() {
    let texels = decode_etc1s(24, 20, &bytes(GLOBAL), &bytes(LEVEL)).unwrap();
    assert_eq!(texels.len(), 480);
    assert_eq!((texels[0], texels[479]), ([0, 0, 0, 247], [227, 219, 145, 65]));
    assert_eq!(digest(&texels), 0xd01c_31cb_b0da_2e2e);

    let mut random = random();
    let (mut all, mut refused) = (Vec::new(), 0);
    for _ in 0..4000 {
        let block: [u8; 16] = std::array::from_fn(|_| random() as u8);
        match decode_uastc(4, 4, &block) {
            Ok(texels) => all.extend(texels),
            Err(_) => refused += 1,
        }
    }
    assert_eq!((all.len() / 16, refused), (3872, 128));
    assert_eq!(digest(&all), 0x9442_55fe_47c5_81f9);
}

/// Without the guard that stands around every decoder of textures.
#[test]
fn damaged_bytes_are_refused_or_decoded_and_nothing_panics() {
    let (global, level) = (bytes(GLOBAL), bytes(LEVEL));
    let mut random = random();
    let (mut decoded, mut refused) = (0, 0);
    for _ in 0..2000 {
        let mut parts = [global.clone(), level.clone()];
        for _ in 0..1 + random() % 4 {
            let part = &mut parts[random() % 2];
            if part.is_empty() {
                continue;
            }
            let at = random() % part.len();
            match random() % 5 {
                0 => part[at] = random() as u8,
                1 => part[at] ^= 1 << (random() % 8),
                2 => part[at] = 255,
                3 => part[at] = 0,
                _ => part.truncate(at),
            }
        }
        match decode_etc1s(24, 20, &parts[0], &parts[1]) {
            Ok(texels) => {
                assert_eq!(texels.len(), 480);
                decoded += 1;
            }
            Err(_) => refused += 1,
        }
    }
    assert!(decoded > 100 && refused > 100, "{decoded} decoded, {refused} refused");
}

/// UASTC becomes BC7 with little loss: what the transcoder packs, our BC7 decoder must unpack to nearly the texels
/// that the transcoder gives for the same block.
#[test]
fn bc7_of_the_transcoder_is_what_our_decoder_reads() {
    let mut state = 1u64;
    let mut random = move || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 56) as u8
    };
    let mut errors = Vec::new();
    let mut modes = [0; 8];
    for _ in 0..4000 {
        let block: [u8; 16] = std::array::from_fn(|_| random());
        let (Ok(texels), Ok(packed)) =
            (decode_uastc(4, 4, &block), transcode(4, 4, None, &[&block], TargetFormat::Bc7Rgba))
        else {
            continue;
        };
        let packed: [u8; 16] = packed.try_into().unwrap();
        modes[packed[0].trailing_zeros() as usize] += 1;
        let ours = bc7::decode(packed);
        let difference = |a: &[u8; 4], b: &[u8; 4]| (0..4).map(|c| u32::from(a[c].abs_diff(b[c]))).sum::<u32>();
        errors.push(texels.iter().zip(&ours).map(|(a, b)| difference(a, b)).sum::<u32>() as f32 / 64.0);
    }
    errors.sort_by(f32::total_cmp);
    assert!(errors.len() > 1000, "{}", errors.len());
    // Five modes and more are met; a wrong table or bit would be off by dozens.
    assert!(modes.iter().filter(|&&count| count > 20).count() >= 5, "{modes:?}");
    let (median, most) = (errors[errors.len() / 2], errors[errors.len() * 99 / 100]);
    assert!(median < 1.5 && most < 12.0, "median {median}, 99 % {most}");
}
