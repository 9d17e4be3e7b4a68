//! Reports, opened in a browser: what is drawn, what mouse and keys do, and that nothing is fetched.

mod browser;

use browser::{Browser, there_is_a_browser};
use lucerna_samples::report::{Axis, Cell, Comparison, Page, Plot, Section, Table};
use serde_json::Value;

const WIDTH: u32 = 16;
const HEIGHT: u32 = 12;
const LEFT: char = '\u{e012}';

fn page() -> Page {
    let mut page = Page::new("Letters & <signs>");
    page.summary = "With *emphasis*, `code` and <b>no markup</b>.".into();
    page.facts = vec![("Device".into(), "a \"device\" & driver".into()), ("Seed".into(), "7".into())];
    let mut numbers = Section::new("Numbers");
    numbers.add(
        Table::figures("paper", "Paper and ours")
            .figure("gain", "%", 5.88, 7.35)
            .figure("views", "", 227.0, None)
            .figure("new", "ms", None, 1.0 / 3.0),
    );
    numbers.add(
        Table::new("odd", "Odd cells", ["name, with comma", "value"])
            .row(["a \"b\" <c>".into(), Cell::Number(-1.5e-7)]),
    );
    numbers.add(Table::new("clock", "By the clock", ["ms"]).row([12.5.into()]).timed());
    let axes = || (Axis::new("samples").log(), Axis::new("time (ms)"));
    let (x, y) = axes();
    numbers.add(
        Plot::new("lines", "Lines", x, y)
            .line("one", [(24.0, 1.0), (48.0, 2.0), (80.0, f64::NAN)])
            .points("two", [(30.0, 1.5)])
            .across(1.2, "paper"),
    );
    numbers.add(
        Plot::new("bars", "Bars", Axis::new("scene").names(["a", "b"]), Axis::new("error")).bars("x", [0.5, -0.25]),
    );
    numbers.add(Plot::new("spread", "Histogram", Axis::new("gain (%)"), Axis::new("views")).histogram(
        "all",
        &[0.0, 1.0, 1.0, 4.0],
        4,
    ));
    let (x, y) = axes();
    numbers.add(Plot::new("empty", "Nothing", x, y).line("none", []));
    page.add(numbers);
    let mut images = Section::new("Images");
    // Every pixel its own value; the second is the first and a half.
    let one: Vec<[f32; 3]> =
        (0..WIDTH * HEIGHT).map(|i| [i as f32 / 64.0, 0.5, if i == 0 { 1000.0 } else { 0.0 }]).collect();
    let two = one.iter().map(|pixel| pixel.map(|v| v + 0.5)).collect();
    let three = vec![[0.18; 3]; one.len()];
    images.add(
        Comparison::new("set", "Three", WIDTH, HEIGHT)
            .with("first", one)
            .with("second", two)
            .with("grey \"third\"", three),
    );
    images.add(
        Comparison::new("alone", "One alone", WIDTH, HEIGHT)
            .with("only", vec![[1.0, 0.0, 0.0]; (WIDTH * HEIGHT) as usize]),
    );
    page.add(images);
    page
}

/// Text of a table in the browser, row by row.
fn table(browser: &Browser, id: &str) -> Vec<Vec<String>> {
    let script = format!(
        "return [...document.querySelectorAll('#table-{id} tr')].map(row => [...row.children].map(cell => cell.dataset.value || cell.textContent))"
    );
    serde_json::from_value(browser.js(&script)).unwrap()
}

#[test]
fn a_page_is_complete_and_answers_to_mouse_and_keys() {
    if !there_is_a_browser() {
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    let files = page().write(folder.path()).unwrap();
    let names: Vec<_> = files.iter().map(|path| path.file_name().unwrap().to_str().unwrap()).collect();
    assert_eq!(names, ["report.html", "report.json", "report.csv", "times.json", "times.csv"]);
    let browser = Browser::new(1000, 1400);
    browser.open(&files[0]);

    text_and_tables(&browser, folder.path());
    viewer(&browser);
    narrow(&browser);

    // The advice about reading pixels back is about this test.
    let complaints: Vec<String> =
        browser.complaints().into_iter().filter(|c| !c.contains("willReadFrequently")).collect();
    assert_eq!(complaints, Vec::<String>::new());
    // The browser's own start page is none of ours.
    let ours = |url: &String| ["data:", "file:///", "chrome://"].iter().any(|start| url.starts_with(start));
    let outside: Vec<String> = browser.requests().into_iter().filter(|url| !ours(url)).collect();
    assert_eq!(outside, Vec::<String>::new());
    // The page itself, and nothing beside it.
    assert!(!std::fs::read_to_string(&files[0]).unwrap().contains("://"), "an address in the page");
}

fn text_and_tables(browser: &Browser, folder: &std::path::Path) {
    assert_eq!(browser.js("return document.title"), "Letters & <signs>");
    assert_eq!(
        browser.js("return document.querySelector('.summary').innerHTML"),
        "With <em>emphasis</em>, <code>code</code> and &lt;b&gt;no markup&lt;/b&gt;."
    );
    assert_eq!(browser.js("return document.querySelectorAll('table').length"), 3);
    assert_eq!(browser.js("return document.querySelectorAll('.plot svg').length"), 4);
    // Two dots, one dot; the value that is no number has none.
    assert_eq!(browser.js("return document.querySelectorAll('#plot-lines .plot .dot').length"), 3);
    assert_eq!(browser.js("return document.querySelectorAll('#plot-spread .plot .bar').length"), 4);
    // Bars begin at zero: the negative one lies below the positive one.
    let edges = browser.js("return [...document.querySelectorAll('#plot-bars .plot .bar')].map(bar => [+bar.getAttribute('y'), +bar.getAttribute('height')])");
    let edge = |bar: usize, i: usize| edges[bar][i].as_f64().unwrap();
    assert!(
        (edge(0, 0) + edge(0, 1) - edge(1, 0)).abs() < 0.2 && (edge(0, 1) / edge(1, 1) - 2.0).abs() < 0.02,
        "{edges}"
    );

    // What the page shows is what the data files say.
    let json: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("report.json")).unwrap()).unwrap();
    let times: Value = serde_json::from_str(&std::fs::read_to_string(folder.join("times.json")).unwrap()).unwrap();
    let csv = std::fs::read_to_string(folder.join("report.csv")).unwrap();
    for (id, tables) in [("paper", &json), ("odd", &json), ("clock", &times)] {
        let shown = table(browser, id);
        let said = &tables["tables"][id];
        let head: Vec<String> = serde_json::from_value(said["columns"].clone()).unwrap();
        assert_eq!(shown[0], head);
        for (row, said) in shown[1..].iter().zip(said["rows"].as_array().unwrap()) {
            for (cell, said) in row.iter().zip(said.as_array().unwrap()) {
                match said {
                    Value::Null => assert_eq!(cell, ""),
                    Value::String(text) => assert_eq!(cell, text),
                    number => assert_eq!(cell.parse::<f64>().unwrap(), number.as_f64().unwrap()),
                }
            }
        }
        assert_eq!(csv.contains(&format!("# {id}: ")), id != "clock");
    }
    assert_eq!(table(browser, "paper")[1][4], (7.35 / 5.88).to_string());
    assert!(json["tables"]["clock"].is_null() && json["plots"]["lines"]["series"][0]["points"][2][1].is_null());
    assert!(csv.contains("gain,%,5.88,7.35,1.25\n") && csv.contains("\"a \"\"b\"\" <c>\",-0.00000015\n"), "{csv}");
}

/// Something of the stage's state.
fn stage(browser: &Browser, what: &str) -> String {
    browser
        .js(&format!("return document.querySelector('#images-set .stage').dataset.{what}"))
        .as_str()
        .unwrap()
        .to_owned()
}

/// The colour in the middle of an image pixel, as drawn.
fn drawn(browser: &Browser, x: u32, y: u32) -> [u64; 3] {
    let script = format!(
        "const c = document.querySelector('#images-set canvas'); \
         const d = c.getContext('2d').getImageData(({x} + .5) / {WIDTH} * c.width, ({y} + .5) / {HEIGHT} * c.height, 1, 1).data; \
         return [d[0], d[1], d[2]]"
    );
    serde_json::from_value(browser.js(&script)).unwrap()
}

fn srgb(value: f32) -> u64 {
    let v = value.clamp(0.0, 1.0);
    let coded = if v <= 0.003_130_8 { 12.92 * v } else { 1.055 * v.powf(1.0 / 2.4) - 0.055 };
    (coded * 255.0).round() as u64
}

#[track_caller]
fn near(found: [u64; 3], wanted: [f32; 3]) {
    let wanted = wanted.map(srgb);
    assert!(found.iter().zip(wanted).all(|(f, w)| f.abs_diff(w) <= 1), "{found:?} is not {wanted:?}");
}

fn viewer(browser: &Browser) {
    browser.js("document.querySelector('#images-set .stage').scrollIntoView({ block: 'center' })");
    let rectangle = browser.js("const b = document.querySelector('#images-set .stage').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]");
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| rectangle[i].as_f64().unwrap());
    let at = |u: f64, v: f64| (left + u * width, top + v * height);

    // Split: the first image to the left, the second to the right.
    assert_eq!((stage(browser, "mode"), stage(browser, "split")), ("split".into(), "0.500".into()));
    let pixel = |x: u32, y: u32| (y * WIDTH + x) as f32 / 64.0;
    near(drawn(browser, 2, 1), [pixel(2, 1), 0.5, 0.0]);
    near(drawn(browser, 13, 1), [pixel(13, 1) + 0.5, 1.0, 0.5]);
    browser.drag(&[at(0.5, 0.3), at(0.6, 0.3), at(0.9, 0.3)]);
    assert!((stage(browser, "split").parse::<f64>().unwrap() - 0.9).abs() < 0.005, "{}", stage(browser, "split"));
    near(drawn(browser, 13, 1), [pixel(13, 1), 0.5, 0.0]);
    browser.js("document.querySelector('#images-set .stage').focus()");
    browser.keys(&LEFT.to_string().repeat(5));
    assert_eq!(stage(browser, "split"), "0.800");

    // Flip, by keys and by the button.
    browser.keys("f");
    near(drawn(browser, 5, 2), [pixel(5, 2), 0.5, 0.0]);
    browser.keys(" ");
    assert_eq!((stage(browser, "mode"), stage(browser, "shown")), ("flip".into(), "1".into()));
    near(drawn(browser, 5, 2), [pixel(5, 2) + 0.5, 1.0, 0.5]);
    browser.js("document.querySelector('#images-set [data-do=flip]').click()");
    assert_eq!(stage(browser, "shown"), "0");
    browser.keys("3");
    near(drawn(browser, 5, 2), [0.18; 3]);
    // A stop darker.
    browser.keys("[");
    near(drawn(browser, 5, 2), [0.09; 3]);
    browser.keys("]1");

    // The difference is that of linear values.
    browser.keys("d");
    near(drawn(browser, 5, 2), [0.5; 3]);
    browser.keys("]");
    near(drawn(browser, 5, 2), [1.0; 3]);
    browser.keys("[");

    // Values under the cursor are linear and not clipped.
    browser.hover(at(0.5 / f64::from(WIDTH), 0.5 / f64::from(HEIGHT)));
    let readout = "return document.querySelector('#images-set .values').innerText";
    let text = browser.js(readout).as_str().unwrap().to_owned();
    assert!(text.contains("pixel 0, 0") && text.contains("first: 0 0.500 1000"), "{text}");
    browser.keys("f");
    browser.keys("\u{e014}\u{e014}\u{e015}");
    let text = browser.js(readout).as_str().unwrap().to_owned();
    assert!(text.contains("pixel 2, 1") && text.contains("first: 0.281 0.500 0"), "{text}");

    // Zoom by the wheel keeps what is under the mouse; drag pans; 0 shows all again.
    assert_eq!(stage(browser, "zoom"), "fit");
    let corner = (0.25 / f64::from(WIDTH), 0.25 / f64::from(HEIGHT));
    let fit = width / f64::from(WIDTH);
    let tiny = browser.js("return document.querySelector('#images-set .stage').clientWidth").as_f64().unwrap();
    assert!((tiny - width).abs() < 2.0 && fit > 33.0, "the stage is {tiny} wide");
    browser.js("document.querySelector('#images-set').style.width = '200px'");
    std::thread::sleep(std::time::Duration::from_millis(100));
    let rectangle = browser.js("const b = document.querySelector('#images-set .stage').getBoundingClientRect(); return [b.left, b.top, b.width, b.height]");
    let [left, top, width, height] = [0, 1, 2, 3].map(|i| rectangle[i].as_f64().unwrap());
    let at = |u: f64, v: f64| (left + u * width, top + v * height);
    browser.wheel(at(corner.0, corner.1), -100);
    browser.wheel(at(corner.0, corner.1), -100);
    assert_eq!(stage(browser, "zoom"), "24");
    browser.hover(at(corner.0, corner.1));
    assert!(browser.js(readout).as_str().unwrap().contains("pixel 0, 0"));
    browser.drag(&[at(0.9, 0.9), at(0.6, 0.9), at(0.3, 0.9)]);
    browser.hover(at(corner.0, corner.1));
    let text = browser.js(readout).as_str().unwrap().to_owned();
    assert!(text.contains("pixel 4, 0") || text.contains("pixel 5, 0"), "{text}");
    browser.keys("0");
    assert_eq!(stage(browser, "zoom"), "fit");
    browser.js("document.querySelector('#images-set').style.width = ''");
    // One image alone has nothing to flip.
    assert_eq!(browser.js("return document.querySelectorAll('#images-alone [data-do=flip]').length"), 0);
    // Every control has a name.
    let nameless = "return [...document.querySelectorAll('button, select, [tabindex]')].filter(e => !(e.getAttribute('aria-label') || e.getAttribute('aria-labelledby') || e.textContent.trim())).length";
    assert_eq!(browser.js(nameless), 0);
}

/// On a telephone nothing but tables and plots scrolls sideways.
fn narrow(browser: &Browser) {
    browser.js("document.body.style.width = '340px'");
    let wide = "const edge = document.body.getBoundingClientRect().right + 1; \
                return [...document.querySelectorAll('main *')] \
                    .filter(e => !e.closest('.plot, .scroll') && e.getBoundingClientRect().right > edge).map(e => e.outerHTML.slice(0, 60))";
    let wide = browser.js(wide);
    assert_eq!(wide.as_array().map(Vec::len), Some(0), "{wide}");
}
