//! Headless Chromium, controlled by its DevTools protocol.

use std::cell::RefCell;
use std::io::{BufRead, BufReader};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::rc::Rc;

use data_encoding::BASE64;
use serde_json::{Value as Json, json};
use tungstenite::{Message, WebSocket, client};

/// The names of the program.
pub(crate) const NAMES: [&str; 3] = ["chromium-headless-shell", "chromium", "google-chrome"];

/// The first of [`NAMES`] that is installed.
pub(crate) fn chromium() -> Option<&'static str> {
    let runs = |name: &&str| Command::new(name).arg("--version").output().is_ok_and(|run| run.status.success());
    NAMES.into_iter().find(runs)
}

/// A running Chromium, ended with the test.
pub(crate) struct Browser {
    process: Child,
    talk: Rc<RefCell<Talk>>,
}

impl Browser {
    /// Starts Chromium with its files in a folder; `None` if it is not installed.
    pub(crate) fn start(folder: &Path) -> Option<Self> {
        let mut process = Command::new("timeout")
            // It ends even if the test is killed.
            .args(["600", chromium()?, "--headless", "--no-sandbox", "--disable-gpu", "--remote-debugging-port=0"])
            // Draw as on a screen, and load nothing that belongs to the browser itself.
            .args(["--window-size=1280,900", "--force-color-profile=srgb", "--hide-scrollbars", "--no-first-run"])
            .arg(format!("--user-data-dir={}", folder.join("profile").display()))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        let mut lines = BufReader::new(process.stderr.take().unwrap()).lines().map_while(Result::ok);
        let address = lines.find_map(|line| Some(line.strip_prefix("DevTools listening on ")?.to_owned())).unwrap();
        // Read its further output, so that it never waits for its reader.
        std::thread::spawn(move || lines.for_each(drop));
        let place = address.strip_prefix("ws://").and_then(|address| address.split('/').next()).unwrap();
        let (socket, _) = client(&address, TcpStream::connect(place).unwrap()).unwrap();
        let talk = Talk { socket, last: 0, events: Vec::new() };
        Some(Browser { process, talk: Rc::new(RefCell::new(talk)) })
    }

    /// A window of a separate user, who does not share storage with others.
    pub(crate) fn window(&self) -> Page {
        let mut talk = self.talk.borrow_mut();
        let user = talk.ask(None, "Target.createBrowserContext", json!({}))["browserContextId"].clone();
        let target = json!({ "url": "about:blank", "browserContextId": user, "width": 1280, "height": 900 });
        let target = talk.ask(None, "Target.createTarget", target)["targetId"].clone();
        let attach = json!({ "targetId": target, "flatten": true });
        let session = talk.ask(None, "Target.attachToTarget", attach)["sessionId"].as_str().unwrap().to_owned();
        drop(talk);
        let page = Page { talk: Rc::clone(&self.talk), session, target };
        for domain in ["Page", "Runtime", "Log", "Network"] {
            page.ask(&format!("{domain}.enable"), json!({}));
        }
        page
    }
}

#[allow(dead_code, reason = "the tests do not measure it")]
impl Browser {
    /// The process that has started all others.
    pub(crate) fn process(&self) -> u32 {
        self.process.id()
    }
}

impl Drop for Browser {
    fn drop(&mut self) {
        // This ends its children, too; SIGKILL for `timeout` would not.
        let _ = self.talk.borrow_mut().send(None, "Browser.close", json!({}));
        let _ = self.process.wait();
    }
}

/// The conversation with the browser.
struct Talk {
    socket: WebSocket<TcpStream>,
    last: u64,
    events: Vec<Json>,
}

impl Talk {
    fn send(&mut self, session: Option<&str>, method: &str, params: Json) -> tungstenite::Result<u64> {
        self.last += 1;
        let mut request = json!({ "id": self.last, "method": method, "params": params });
        if let Some(session) = session {
            request["sessionId"] = json!(session);
        }
        self.socket.send(Message::text(request.to_string()))?;
        Ok(self.last)
    }

    fn receive(&mut self) -> Json {
        loop {
            if let Message::Text(text) = self.socket.read().expect("the browser runs") {
                return serde_json::from_str(&text).unwrap();
            }
        }
    }

    #[track_caller]
    fn ask(&mut self, session: Option<&str>, method: &str, params: Json) -> Json {
        let id = self.send(session, method, params).expect("the browser runs");
        loop {
            let mut message = self.receive();
            if message["id"] == id {
                assert!(message["error"].is_null(), "{method}: {}", message["error"]);
                return message["result"].take();
            }
            if message["id"].is_null() {
                self.events.push(message);
            }
        }
    }
}

/// A page, used as a person does.
pub(crate) struct Page {
    talk: Rc<RefCell<Talk>>,
    session: String,
    target: Json,
}

#[allow(dead_code, reason = "not every test needs all")]
impl Page {
    #[track_caller]
    fn ask(&self, method: &str, params: Json) -> Json {
        self.talk.borrow_mut().ask(Some(&self.session), method, params)
    }

    /// Waits for an event.
    fn event(&self, method: &str) -> Json {
        let mut talk = self.talk.borrow_mut();
        loop {
            let is_it = |event: &Json| event["method"] == method && event["sessionId"] == self.session.as_str();
            if let Some(found) = talk.events.iter().position(is_it) {
                return talk.events.remove(found);
            }
            let message = talk.receive();
            talk.events.push(message);
        }
    }

    /// The parameters of all events of a kind so far.
    fn events(&self, method: &str) -> Vec<Json> {
        let talk = self.talk.borrow();
        let mine = talk.events.iter().filter(|event| event["sessionId"] == self.session.as_str());
        mine.filter(|event| event["method"] == method).map(|event| event["params"].clone()).collect()
    }

    /// Opens an address, and waits until the page is loaded.
    #[track_caller]
    pub(crate) fn opens(&self, address: &str) {
        let answer = self.ask("Page.navigate", json!({ "url": address }));
        assert!(answer["errorText"].is_null(), "{address}: {answer}");
        self.event("Page.loadEventFired");
    }

    /// Waits until the page to which this one redirects is loaded.
    pub(crate) fn is_led_on(&self) {
        self.event("Page.loadEventFired");
    }

    #[track_caller]
    pub(crate) fn reloads(&self) {
        self.ask("Page.reload", json!({}));
        self.event("Page.loadEventFired");
    }

    /// The value of a JavaScript expression; waits for a promise.
    #[track_caller]
    pub(crate) fn value(&self, expression: &str) -> Json {
        let params = json!({ "expression": expression, "awaitPromise": true, "returnByValue": true });
        let mut answer = self.ask("Runtime.evaluate", params);
        assert!(answer["exceptionDetails"].is_null(), "{expression}: {}\n{}", answer["exceptionDetails"], self.text());
        answer["result"]["value"].take()
    }

    /// The whole text of the page, in one line.
    pub(crate) fn text(&self) -> String {
        let params = json!({ "expression": "document.body.innerText", "returnByValue": true });
        let text = self.ask("Runtime.evaluate", params)["result"]["value"].take();
        text.as_str().unwrap_or_default().split_whitespace().collect::<Vec<_>>().join(" ")
    }

    /// Waits until an expression is true.
    #[track_caller]
    pub(crate) fn until(&self, expression: &str) {
        self.first(expression);
    }

    /// Waits until an expression is truthy; returns its value.
    #[track_caller]
    fn first(&self, expression: &str) -> Json {
        const PATIENCE_MS: u32 = 30_000;
        let found = self.value(&format!(
            "(async () => {{ const end = performance.now() + {PATIENCE_MS};
            while (performance.now() < end) {{
                const found = {expression};
                if (found) return found;
                await new Promise(next => setTimeout(next, 20));
            }} }})()"
        ));
        assert!(!found.is_null(), "never: {expression}\nthe page says:\n{}", self.text());
        found
    }

    /// Waits until a part of the page (`data-test`) has this text.
    #[track_caller]
    pub(crate) fn reads(&self, part: &str, text: &str) {
        self.until(&format!("{}?.innerText.includes({})", one(part), json!(text)));
    }

    /// Waits for a part, and returns its text.
    #[track_caller]
    pub(crate) fn part(&self, part: &str) -> String {
        self.first(&format!("{}?.innerText", one(part))).as_str().unwrap_or_default().to_owned()
    }

    /// Clicks the middle of a part once that is possible, and again if the part has moved meanwhile.
    #[track_caller]
    pub(crate) fn clicks(&self, part: &str) {
        let element = one(part);
        // Query the element again after scrolling to it: the page may have replaced it.
        let place = format!(
            "await (async () => {{
            {element}?.scrollIntoView({{ block: 'center', behavior: 'instant' }});
            await new Promise(next => requestAnimationFrame(next));
            const it = {element};
            if (!it || it.disabled || it.ariaDisabled === 'true') return null;
            window.isClicked = false;
            it.addEventListener('click', () => window.isClicked = true, {{ capture: true, once: true }});
            const box = it.getBoundingClientRect();
            return {{ x: box.x + box.width / 2, y: box.y + box.height / 2 }}; }})()"
        );
        loop {
            let place = self.first(&place);
            for (kind, button, clicks) in
                [("mouseMoved", "none", 0), ("mousePressed", "left", 1), ("mouseReleased", "left", 1)]
            {
                let event =
                    json!({ "type": kind, "x": place["x"], "y": place["y"], "button": button, "clickCount": clicks });
                self.ask("Input.dispatchMouseEvent", event);
            }
            if self.value("window.isClicked") == true {
                return;
            }
        }
    }

    /// Types a text into a part, replacing its content.
    #[track_caller]
    pub(crate) fn types(&self, part: &str, text: &str) {
        let element = one(part);
        self.first(&format!("{element} && !{element}.disabled && ({element}.focus(), {element}.select?.(), true)"));
        self.ask("Input.insertText", json!({ "text": text }));
    }

    /// Chooses an option by its text.
    #[track_caller]
    pub(crate) fn chooses(&self, part: &str, option: &str) {
        let (element, option) = (one(part), json!(option));
        self.until(&format!(
            "[...({element}?.options ?? [])].some(it => it.text.includes({option}) || it.value === {option})"
        ));
        self.value(&format!(
            "(() => {{ const it = {element};
            it.value = [...it.options].find(it => it.value === {option} || it.text.includes({option})).value;
            it.dispatchEvent(new Event('input', {{ bubbles: true }})); it.dispatchEvent(new Event('change', {{ bubbles: true }})); }})()"
        ));
    }

    /// Selects a file in a file input.
    #[track_caller]
    pub(crate) fn gives(&self, part: &str, file: &Path) {
        let element = one(part);
        self.until(&element);
        let object = self.ask("Runtime.evaluate", json!({ "expression": element }))["result"]["objectId"].take();
        self.ask("DOM.setFileInputFiles", json!({ "files": [file], "objectId": object }));
    }

    /// Presses a key, such as `Enter` or `Escape`.
    #[track_caller]
    pub(crate) fn presses(&self, key: &str) {
        for kind in ["keyDown", "keyUp"] {
            let text = if key == "Enter" { "\r" } else { "" };
            let (code, number) = (
                key,
                match key {
                    "Enter" => 13,
                    "Escape" => 27,
                    "Tab" => 9,
                    _ => 0,
                },
            );
            let event =
                json!({ "type": kind, "key": key, "code": code, "text": text, "windowsVirtualKeyCode": number });
            self.ask("Input.dispatchKeyEvent", event);
        }
    }

    /// Downloads files of the page into a folder.
    pub(crate) fn keeps_files_in(&self, folder: &Path) {
        let params = json!({ "behavior": "allow", "downloadPath": folder, "eventsEnabled": false });
        self.ask("Page.setDownloadBehavior", params);
    }

    /// Sets a preference of the user: `("prefers-color-scheme", "dark")`.
    pub(crate) fn prefers(&self, feature: &str, value: &str) {
        self.ask("Emulation.setEmulatedMedia", json!({ "features": [{ "name": feature, "value": value }] }));
    }

    /// A picture of the window as PNG.
    pub(crate) fn picture(&self) -> Vec<u8> {
        let answer = self.ask("Page.captureScreenshot", json!({ "format": "png", "optimizeForSpeed": false }));
        BASE64.decode(answer["data"].as_str().unwrap().as_bytes()).unwrap()
    }

    /// All messages on the console so far, and exceptions of scripts.
    pub(crate) fn said(&self) -> Vec<String> {
        self.value("0");
        let console = self.events("Runtime.consoleAPICalled").into_iter().map(|event| event["args"].to_string());
        let thrown =
            self.events("Runtime.exceptionThrown").into_iter().map(|event| event["exceptionDetails"].to_string());
        let logged = self.events("Log.entryAdded").into_iter().map(|event| event["entry"].to_string());
        console.chain(thrown).chain(logged).collect()
    }

    /// The addresses requested so far.
    pub(crate) fn requests(&self) -> Vec<String> {
        self.value("0");
        let requests = self.events("Network.requestWillBeSent");
        let sockets = self.events("Network.webSocketCreated");
        let requests =
            requests.iter().map(|event| &event["request"]["url"]).chain(sockets.iter().map(|event| &event["url"]));
        requests.map(|url| url.as_str().unwrap_or_default().to_owned()).collect()
    }

    /// The controls on the page without an accessible name.
    pub(crate) fn nameless(&self) -> Vec<String> {
        let tree = self.ask("Accessibility.getFullAXTree", json!({}));
        let nodes = tree["nodes"].as_array().unwrap().iter().filter(|node| node["ignored"] != true);
        let used = [
            "button",
            "textbox",
            "searchbox",
            "combobox",
            "checkbox",
            "radio",
            "slider",
            "link",
            "tab",
            "spinbutton",
            "image",
        ];
        let nameless = nodes.filter(|node| {
            let role = node["role"]["value"].as_str().unwrap_or_default();
            used.contains(&role) && node["name"]["value"].as_str().is_none_or(|name| name.trim().is_empty())
        });
        nameless.map(|node| format!("{} {}", node["role"]["value"], node["properties"])).collect()
    }

    /// Closes the window, as a user who leaves.
    pub(crate) fn closes(self) {
        self.talk.borrow_mut().ask(None, "Target.closeTarget", json!({ "targetId": self.target }));
    }

    /// Blocks the page's script for ever: the browser lives, but the page does not.
    pub(crate) fn hangs(&self) {
        let params = json!({ "expression": "for (;;) {}" });
        self.talk.borrow_mut().send(Some(&self.session), "Runtime.evaluate", params).unwrap();
    }
}

/// The element with this `data-test`, as JavaScript.
fn one(part: &str) -> String {
    format!("document.querySelector({})", json!(format!("[data-test={}]", json!(part))))
}
