//! Headless Chromium, driven by its DevTools protocol: real keys and clicks, and an ear for what goes
//! wrong in a page.

use serde_json::{Value, json};
use std::io::{BufRead, BufReader, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::time::{Duration, Instant};
use tungstenite::{Message, WebSocket};

/// As long as anything may take.
const PATIENCE: Duration = Duration::from_secs(60);

/// A browser with one page.
pub struct Browser {
    process: Child,
    socket: WebSocket<TcpStream>,
    session: String,
    next: u64,
    events: Vec<Value>,
    _profile: tempfile::TempDir,
}

/// The name of the installed browser, if any.
pub fn installed() -> Option<String> {
    let named = std::env::var("TWEENRAY_CHROMIUM").ok();
    let names = ["chromium", "chromium-browser", "google-chrome"].map(String::from);
    named.into_iter().chain(names).find(|name| {
        let asked = Command::new(name).arg("--version").stderr(Stdio::null()).output();
        asked.is_ok_and(|output| output.status.success())
    })
}

impl Browser {
    pub fn start(name: &str) -> Self {
        let profile = tempfile::tempdir().expect("a folder");
        let mut process = Command::new(name)
            .args(["--headless=new", "--no-sandbox", "--disable-gpu", "--disable-dev-shm-usage"])
            .args(["--remote-debugging-port=0", "--no-first-run", "--hide-scrollbars"])
            .args(["--disable-background-networking", "--disable-component-update"])
            .args(["--disable-extensions", "--force-device-scale-factor=1"])
            .arg(format!("--user-data-dir={}", profile.path().display()))
            .arg("about:blank")
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn()
            .expect("the browser starts");
        let url = listening_at(&mut process);
        let place = url.trim_start_matches("ws://").split('/').next().expect("a place");
        let stream = TcpStream::connect(place).expect("the browser listens");
        stream.set_read_timeout(Some(PATIENCE)).expect("a timeout");
        let (socket, _) = tungstenite::client(url.as_str(), stream).expect("a web socket");
        let (session, events) = (String::new(), Vec::new());
        let mut browser = Self { process, socket, session, next: 0, events, _profile: profile };
        let target = browser.call("Target.createTarget", json!({"url": "about:blank"}));
        let target = target["targetId"].clone();
        let attached =
            browser.call("Target.attachToTarget", json!({"targetId": target, "flatten": true}));
        browser.session = attached["sessionId"].as_str().expect("a session").into();
        for domain in ["Page", "Runtime", "Log", "Network"] {
            browser.call(&format!("{domain}.enable"), json!({}));
        }
        browser.call("Page.setLifecycleEventsEnabled", json!({"enabled": true}));
        // Elements get the focus and its events, whichever window the machine thinks is in front.
        browser.call("Emulation.setFocusEmulationEnabled", json!({"enabled": true}));
        browser
    }

    /// Calls a method of the protocol; gives its result.
    pub fn call(&mut self, method: &str, params: Value) -> Value {
        self.next += 1;
        let mut message = json!({"id": self.next, "method": method, "params": params});
        if !self.session.is_empty() {
            message["sessionId"] = self.session.clone().into();
        }
        self.socket.send(Message::text(message.to_string())).expect("sent");
        loop {
            let answer = self.hear();
            if answer["id"] == self.next {
                assert!(answer["error"].is_null(), "{method}: {}", answer["error"]);
                return answer["result"].clone();
            }
            self.events.push(answer);
        }
    }

    fn hear(&mut self) -> Value {
        let message = self.socket.read().expect("the browser answers");
        serde_json::from_str(message.to_text().expect("text")).expect("JSON")
    }

    /// Opens the page at `file` in a window of this size, light or dark.
    pub fn open(&mut self, file: &Path, (width, height): (u32, u32), dark: bool) {
        let scheme = if dark { "dark" } else { "light" };
        let features = json!([{"name": "prefers-color-scheme", "value": scheme}]);
        self.call("Emulation.setEmulatedMedia", json!({"features": features}));
        let metrics =
            json!({"width": width, "height": height, "deviceScaleFactor": 1, "mobile": false});
        self.call("Emulation.setDeviceMetricsOverride", metrics);
        let url = format!("file://{}", file.canonicalize().expect("a file").display());
        let navigated = self.call("Page.navigate", json!({"url": url}));
        // Asked too early, the page that was there before would answer for the new one.
        let loader = navigated["loaderId"].as_str().expect("a new page").to_string();
        self.await_event(|event| {
            event["method"] == "Page.lifecycleEvent"
                && event["params"]["name"] == "load"
                && event["params"]["loaderId"] == *loader
        });
    }

    /// Waits for an event, which may have come already.
    fn await_event(&mut self, is_it: impl Fn(&Value) -> bool) {
        let start = Instant::now();
        while !self.events.iter().any(&is_it) {
            assert!(start.elapsed() < PATIENCE, "waited in vain for an event");
            let event = self.hear();
            self.events.push(event);
        }
    }

    /// What the expression is in the page; a promise's outcome.
    pub fn value(&mut self, expression: &str) -> Value {
        let params = json!({"expression": expression, "returnByValue": true, "awaitPromise": true});
        let result = self.call("Runtime.evaluate", params);
        assert!(result["exceptionDetails"].is_null(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    pub fn text(&mut self, expression: &str) -> String {
        let value = self.value(expression);
        value.as_str().unwrap_or_else(|| panic!("{expression} is {value}")).into()
    }

    pub fn number(&mut self, expression: &str) -> f64 {
        let value = self.value(expression);
        value.as_f64().unwrap_or_else(|| panic!("{expression} is {value}"))
    }

    /// Waits until the expression is true.
    #[track_caller]
    pub fn wait(&mut self, expression: &str) {
        let start = Instant::now();
        while self.value(expression) != true {
            assert!(start.elapsed() < PATIENCE, "waited in vain for {expression}");
            std::thread::sleep(Duration::from_millis(20));
        }
    }

    /// Presses and releases a key: `ArrowLeft`, `Home`, `m`, ` `.
    pub fn press(&mut self, key: &str) {
        let virtual_key = match key {
            "ArrowLeft" => 37,
            "ArrowUp" => 38,
            "ArrowRight" => 39,
            "ArrowDown" => 40,
            "Home" => 36,
            "End" => 35,
            "Tab" => 9,
            "Enter" => 13,
            " " => 32,
            letter => u32::from(letter.to_ascii_uppercase().as_bytes()[0]),
        };
        let text = match key {
            "Enter" => "\r",
            key if key.len() == 1 => key,
            _ => "",
        };
        for kind in ["keyDown", "keyUp"] {
            let mut event = json!({"type": kind, "key": key, "windowsVirtualKeyCode": virtual_key});
            if kind == "keyDown" && !text.is_empty() {
                event["text"] = text.into();
            }
            self.call("Input.dispatchKeyEvent", event);
        }
    }

    /// Clicks at a share of the element's width and height.
    pub fn click(&mut self, selector: &str, (across, down): (f64, f64)) {
        let place = self.value(&format!(
            "(() => {{ const e = document.querySelector({selector:?}); \
             e.scrollIntoView({{block: 'center'}}); \
             const b = e.getBoundingClientRect(); \
             return [b.left + b.width * {across}, b.top + b.height * {down}]; }})()"
        ));
        let mouse = |kind: &str| json!({"type": kind, "x": place[0], "y": place[1], "button": "left", "clickCount": 1});
        self.call("Input.dispatchMouseEvent", mouse("mousePressed"));
        self.call("Input.dispatchMouseEvent", mouse("mouseReleased"));
    }

    /// The whole page as a png file.
    pub fn screenshot(&mut self, file: &Path) {
        use base64::Engine;
        let params = json!({"captureBeyondViewport": true, "format": "png"});
        let shot = self.call("Page.captureScreenshot", params);
        let data = shot["data"].as_str().expect("a picture");
        let bytes = base64::engine::general_purpose::STANDARD.decode(data).expect("base64");
        std::fs::File::create(file).and_then(|mut f| f.write_all(&bytes)).expect("written");
    }

    /// Panics if the page complained or asked for anything but itself.
    pub fn was_quiet(&mut self) {
        self.value("1");
        for event in &self.events {
            let method = event["method"].as_str().unwrap_or_default();
            let params = &event["params"];
            match method {
                "Runtime.exceptionThrown" | "Log.entryAdded" => panic!("{params}"),
                "Runtime.consoleAPICalled" => panic!("console: {params}"),
                "Network.requestWillBeSent" => {
                    let url = params["request"]["url"].as_str().unwrap_or_default();
                    let own = ["file://", "data:", "about:"].iter().any(|p| url.starts_with(p));
                    assert!(own, "the page asks for {url}");
                }
                _ => {}
            }
        }
    }
}

fn listening_at(process: &mut Child) -> String {
    let stderr = process.stderr.take().expect("piped");
    let mut lines = BufReader::new(stderr).lines();
    let url = lines
        .by_ref()
        .map_while(Result::ok)
        .find_map(|line| line.strip_prefix("DevTools listening on ").map(str::to_owned));
    // Read on, or a full pipe would stop the browser.
    std::thread::spawn(move || lines.for_each(drop));
    url.expect("the browser says where it listens")
}

impl Drop for Browser {
    fn drop(&mut self) {
        // Asked to close, it ends its own children; killed, it would leave them behind.
        let close = json!({"id": self.next + 1, "method": "Browser.close"});
        let asked = self.socket.send(Message::text(close.to_string())).is_ok();
        let start = Instant::now();
        while asked && start.elapsed() < Duration::from_secs(10) {
            if matches!(self.process.try_wait(), Ok(Some(_))) {
                return;
            }
            std::thread::sleep(Duration::from_millis(20));
        }
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
