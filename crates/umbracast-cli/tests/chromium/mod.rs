//! A headless Chromium, driven over its DevTools protocol, and what it looks at.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::Duration;

use serde_json::{Value, json};
use tungstenite::stream::MaybeTlsStream;
use tungstenite::{Message, WebSocket};

/// A command that serves a page. It ends with this, and would end by itself where nobody held the other side of what it says.
pub struct Served(Child, #[expect(dead_code, reason = "held, not read")] BufReader<ChildStdout>);

impl Served {
    /// Starts `umbracast` and waits until it says where the page is; its address.
    pub fn start<I: AsRef<std::ffi::OsStr>>(arguments: impl IntoIterator<Item = I>) -> (Self, String) {
        let mut child = Command::new(env!("CARGO_BIN_EXE_umbracast"))
            .args(arguments)
            .stdout(Stdio::piped())
            .spawn()
            .expect("starts");
        let mut line = String::new();
        let mut said = BufReader::new(child.stdout.take().expect("piped"));
        said.read_line(&mut line).expect("a line");
        let address = line.trim().strip_prefix("page: ").expect("the page's address").to_owned();
        (Self(child, said), address)
    }
}

impl Drop for Served {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// The browser and one page in it. Both end with this.
pub struct Page {
    browser: Child,
    socket: WebSocket<MaybeTlsStream<TcpStream>>,
    asked: u64,
}

impl Page {
    /// Opens an address; `None`, told on the terminal, where no Chromium is installed.
    pub fn open(address: &str, profile: &Path) -> Option<Self> {
        let name = std::env::var("CHROMIUM").unwrap_or_else(|_| "chromium".to_owned());
        let started = Command::new(&name)
            .args(["--headless=new", "--no-sandbox", "--no-first-run", "--disable-sync"])
            // WebGL by software: no graphics card is needed.
            .args(["--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader"])
            .arg("--ignore-gpu-blocklist")
            .args(["--disable-background-networking", "--disable-component-update", "--disable-quic"])
            .args(["--remote-debugging-port=0", "about:blank"])
            .arg(format!("--user-data-dir={}", profile.display()))
            .stdout(Stdio::null())
            .stderr(Stdio::piped())
            .spawn();
        let Ok(mut browser) = started else {
            // To the terminal itself: a test's output is held back when it passes.
            let _ = writeln!(std::io::stderr(), "skipped: no {name} to look at the page with");
            return None;
        };
        let mut said = BufReader::new(browser.stderr.take().expect("piped"));
        let listening = (&mut said).lines().map_while(Result::ok).find_map(|line| {
            let (_, rest) = line.split_once("DevTools listening on ws://")?;
            Some(rest.split('/').next()?.to_owned())
        });
        let host = listening.expect("Chromium says where it listens");
        // It goes on to talk; nobody listening would end it.
        std::thread::spawn(move || std::io::copy(&mut said, &mut std::io::sink()));
        let body = put(&host, &format!("/json/new?{address}"));
        let url = body["webSocketDebuggerUrl"].as_str().expect("the page's own address").to_owned();
        let (socket, _) = tungstenite::connect(url).expect("connects to the page");
        Some(Self { browser, socket, asked: 0 })
    }

    /// Calls a method of the protocol and waits for its result.
    pub fn call(&mut self, method: &str, parameters: Value) -> Value {
        self.asked += 1;
        let question = json!({ "id": self.asked, "method": method, "params": parameters });
        self.socket.send(Message::text(question.to_string())).expect("asks");
        loop {
            let message = self.socket.read().expect("an answer");
            let Ok(answer) = serde_json::from_str::<Value>(message.to_text().unwrap_or_default()) else {
                continue;
            };
            if answer["id"] == self.asked {
                assert!(answer.get("error").is_none(), "{method}: {answer}");
                return answer["result"].clone();
            }
        }
    }

    /// The value of an expression in the page.
    pub fn value(&mut self, expression: &str) -> Value {
        let parameters = json!({ "expression": expression, "returnByValue": true, "awaitPromise": true });
        let result = self.call("Runtime.evaluate", parameters);
        assert!(result.get("exceptionDetails").is_none(), "{expression}: {result}");
        result["result"]["value"].clone()
    }

    /// Waits until an expression is true; what the page does not know yet is false. Half a minute or so at most.
    pub fn until(&mut self, expression: &str) {
        let safe = format!("(() => {{ try {{ return !!({expression}); }} catch {{ return false; }} }})()");
        for _ in 0..600 {
            if self.value(&safe) == true {
                return;
            }
            std::thread::sleep(Duration::from_millis(50));
        }
        panic!("never true: {expression}");
    }

    /// As on a screen of that size.
    pub fn size(&mut self, width: u32, height: u32) {
        let metrics =
            json!({ "width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600 });
        self.call("Emulation.setDeviceMetricsOverride", metrics);
    }

    /// A picture of the page, where the folder UMBRACAST_SCREENSHOTS is given.
    pub fn screenshot(&mut self, name: &str) {
        let Some(folder) = std::env::var_os("UMBRACAST_SCREENSHOTS") else { return };
        let shot =
            self.call("Page.captureScreenshot", json!({ "format": "png", "captureBeyondViewport": true }));
        let bytes = from_base64(shot["data"].as_str().expect("a picture"));
        std::fs::write(Path::new(&folder).join(name), bytes).expect("writes");
    }
}

impl Drop for Page {
    fn drop(&mut self) {
        let _ = self.browser.kill();
        let _ = self.browser.wait();
    }
}

/// Asks Chromium by HTTP; the connection stays open, so the answer's own length says where it ends.
fn put(host: &str, path: &str) -> Value {
    let mut stream = BufReader::new(TcpStream::connect(host).expect("connects"));
    write!(stream.get_mut(), "PUT {path} HTTP/1.1\r\nHost: {host}\r\n\r\n").expect("asks");
    let mut length = 0;
    loop {
        let mut line = String::new();
        stream.read_line(&mut line).expect("an answer");
        if line.trim().is_empty() {
            break;
        }
        if let Some((name, value)) = line.split_once(':')
            && name.eq_ignore_ascii_case("content-length")
        {
            length = value.trim().parse().expect("a length");
        }
    }
    let mut body = vec![0; length];
    stream.read_exact(&mut body).expect("a body");
    serde_json::from_slice(&body).expect("JSON")
}

fn from_base64(text: &str) -> Vec<u8> {
    const LETTERS: &[u8] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    let (mut bytes, mut bits, mut held) = (Vec::new(), 0_u32, 0);
    for letter in text.bytes().filter_map(|b| LETTERS.iter().position(|&letter| letter == b)) {
        bits = bits << 6 | letter as u32;
        held += 6;
        if held >= 8 {
            held -= 8;
            bytes.push((bits >> held) as u8);
        }
    }
    bytes
}
