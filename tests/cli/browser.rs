//! A browser without a window, by the WebDriver protocol (W3C) over plain HTTP.

use std::{
    io::{BufRead, BufReader, Read, Write},
    net::TcpStream,
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

use serde_json::{Value, json};

const CHROMIUM: &str = "/usr/bin/chromium";
const DRIVER: &str = "/usr/bin/chromedriver";

/// A running browser with one page.
pub struct Browser {
    driver: Child,
    port: u16,
    session: String,
    _folder: tempfile::TempDir,
}

impl Drop for Browser {
    fn drop(&mut self) {
        if !self.session.is_empty() {
            let _ = self.request("DELETE", &format!("/session/{}", self.session), None);
        }
        let _ = self.driver.kill();
        let _ = self.driver.wait();
    }
}

/// False, loudly, where there is no Chromium and the tests are not CI's.
pub fn there_is_a_browser() -> bool {
    let there = Path::new(CHROMIUM).is_file() && Path::new(DRIVER).is_file();
    assert!(there || std::env::var_os("CI").is_none(), "{CHROMIUM} or {DRIVER} is missing: run ci/setup");
    if !there {
        eprintln!("SKIPPED: {CHROMIUM} or {DRIVER} is not installed (Debian: chromium, chromium-driver)");
    }
    there
}

impl Browser {
    /// Opens a window of a size; `dark`: as if the system were dark.
    pub fn new(width: u32, height: u32) -> Self {
        let mut driver = Command::new(DRIVER)
            .arg("--port=0")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("chromedriver starts");
        let folder = tempfile::tempdir().expect("a folder for the profile");
        let mut said = BufReader::new(driver.stdout.take().expect("piped"));
        let mut port = 0;
        let mut line = String::new();
        while port == 0 && said.read_line(&mut line).is_ok_and(|read| read > 0) {
            // "ChromeDriver was started successfully on port 12345."
            let number = line.trim_end().trim_end_matches('.').rsplit_once("on port ").map(|(_, number)| number);
            port = number.and_then(|number| number.parse().ok()).unwrap_or(0);
            line.clear();
        }
        // What else it says must go somewhere.
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        let mut browser = Self { driver, port, session: String::new(), _folder: folder };
        assert!(port != 0, "chromedriver did not say its port");
        let profile = format!("--user-data-dir={}", browser._folder.path().display());
        let window = format!("--window-size={width},{height}");
        let arguments = [
            "--headless",
            "--no-sandbox",
            "--disable-gpu",
            "--disable-quic",
            "--no-first-run",
            "--disable-background-networking",
            "--disable-component-update",
            "--disable-sync",
            &profile,
            &window,
        ];
        let options = json!({ "binary": CHROMIUM, "args": arguments });
        let logs = json!({ "browser": "ALL", "performance": "ALL" });
        let wanted = json!({ "goog:chromeOptions": options, "goog:loggingPrefs": logs });
        let answer = browser.request("POST", "/session", Some(json!({ "capabilities": { "alwaysMatch": wanted } })));
        browser.session = answer["sessionId"].as_str().unwrap_or_else(|| panic!("no session: {answer}")).to_owned();
        browser
    }

    fn request(&self, method: &str, path: &str, body: Option<Value>) -> Value {
        let body = body.map(|body| body.to_string()).unwrap_or_default();
        let mut stream = TcpStream::connect(("127.0.0.1", self.port)).expect("chromedriver listens");
        stream.set_read_timeout(Some(Duration::from_secs(120))).expect("a timeout can be set");
        write!(
            stream,
            "{method} {path} HTTP/1.1\r\nHost: 127.0.0.1\r\nContent-Type: application/json\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{body}",
            body.len()
        )
        .expect("chromedriver reads");
        let mut stream = BufReader::new(stream);
        let (mut line, mut length) = (String::new(), 0);
        while stream.read_line(&mut line).is_ok_and(|read| read > 2) {
            if let Some(value) = line.to_ascii_lowercase().strip_prefix("content-length:") {
                length = value.trim().parse().expect("a length");
            }
            line.clear();
        }
        let mut answer = vec![0; length];
        stream.read_exact(&mut answer).expect("chromedriver answers");
        let mut answer: Value = serde_json::from_slice(&answer).expect("chromedriver speaks JSON");
        let value = answer["value"].take();
        assert!(value["error"].is_null(), "{method} {path}: {value}");
        value
    }

    fn command(&self, method: &str, path: &str, body: Option<Value>) -> Value {
        self.request(method, &format!("/session/{}{path}", self.session), body)
    }

    /// Opens a file and waits for its images.
    pub fn open(&self, file: &Path) {
        self.command("POST", "/url", Some(json!({ "url": format!("file://{}", file.display()) })));
        let begun = Instant::now();
        while self.js("return document.documentElement.dataset.ready || ''") != "true" {
            assert!(begun.elapsed() < Duration::from_secs(60), "the images do not come: {:?}", self.complaints());
            std::thread::sleep(Duration::from_millis(50));
        }
    }

    /// Runs a script and returns what it returns.
    pub fn js(&self, script: &str) -> Value {
        self.command("POST", "/execute/sync", Some(json!({ "script": script, "args": [] })))
    }

    /// Mouse: goes to the first point, presses, goes to the others, lets go. CSS pixels of the window.
    pub fn drag(&self, points: &[(f64, f64)]) {
        let go = |&(x, y): &(f64, f64)| json!({ "type": "pointerMove", "duration": 0, "x": x.round() as i64, "y": y.round() as i64 });
        let mut actions = vec![go(&points[0]), json!({ "type": "pointerDown", "button": 0 })];
        actions.extend(points[1..].iter().map(go));
        actions.push(json!({ "type": "pointerUp", "button": 0 }));
        self.act(
            json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": actions }),
        );
    }

    /// Mouse: goes there without pressing.
    pub fn hover(&self, (x, y): (f64, f64)) {
        let go = json!({ "type": "pointerMove", "duration": 0, "x": x.round() as i64, "y": y.round() as i64 });
        self.act(
            json!({ "type": "pointer", "id": "mouse", "parameters": { "pointerType": "mouse" }, "actions": [go] }),
        );
    }

    /// Wheel at a point; negative turns away from the hand.
    pub fn wheel(&self, (x, y): (f64, f64), by: i32) {
        let turn = json!({ "type": "scroll", "duration": 0, "x": x.round() as i64, "y": y.round() as i64, "deltaX": 0, "deltaY": by });
        self.act(json!({ "type": "wheel", "id": "wheel", "actions": [turn] }));
    }

    /// Presses keys one after the other, with the WebDriver codes for those that are no letters.
    pub fn keys(&self, keys: &str) {
        let press = |key: char| {
            [
                json!({ "type": "keyDown", "value": key.to_string() }),
                json!({ "type": "keyUp", "value": key.to_string() }),
            ]
        };
        let actions: Vec<Value> = keys.chars().flat_map(press).collect();
        self.act(json!({ "type": "key", "id": "keys", "actions": actions }));
    }

    fn act(&self, source: Value) {
        self.command("POST", "/actions", Some(json!({ "actions": [source] })));
    }

    /// What the console says.
    pub fn complaints(&self) -> Vec<String> {
        let log = self.command("POST", "/se/log", Some(json!({ "type": "browser" })));
        log.as_array().into_iter().flatten().map(|entry| entry["message"].to_string()).collect()
    }

    /// Addresses that were asked for since the last call.
    pub fn requests(&self) -> Vec<String> {
        let log = self.command("POST", "/se/log", Some(json!({ "type": "performance" })));
        let messages = log.as_array().into_iter().flatten().filter_map(|entry| {
            let message: Value = serde_json::from_str(entry["message"].as_str()?).ok()?;
            let message = &message["message"];
            (message["method"] == "Network.requestWillBeSent")
                .then(|| message["params"]["request"]["url"].as_str().unwrap_or_default().to_owned())
        });
        messages.collect()
    }
}
