//! A static server for one folder, whose pages report what they show.

use std::io::{BufRead, BufReader, Read, Write};
use std::net::{TcpListener, TcpStream};
use std::path::{Path, PathBuf};
use std::sync::{Arc, Mutex};

use image::RgbImage;

/// What a page has reported last.
#[derive(Clone)]
pub struct State {
    pub title: String,
    pub picture: RgbImage,
    /// Middle of the button for indirect light, pixels.
    pub indirect: [u32; 2],
}

pub struct Server {
    pub address: String,
    state: Arc<Mutex<Option<State>>>,
}

/// Reports the title, the button and the picture, all of one moment, twice a second. A report
/// starts when the one before has arrived, so that none overtakes another.
const REPORT: &str = r#"<script>
(async () => {
  const canvas = document.getElementById('view');
  const button = document.querySelector('[data-part="indirect"]');
  for (;;) {
    const box = button.getBoundingClientRect();
    const at = [box.x + box.width / 2, box.y + box.height / 2].map(Math.round);
    const about = at.join(',') + ',' + encodeURIComponent(document.title);
    const png = await new Promise((done) => canvas.toBlob(done));
    if (png) await fetch('/state?' + about, { method: 'POST', body: png }).catch(() => {});
    await new Promise((done) => setTimeout(done, 500));
  }
})();
</script>"#;

impl Server {
    pub fn start(folder: &Path) -> Self {
        let listener = TcpListener::bind("127.0.0.1:0").expect("a port");
        let address = listener.local_addr().expect("an address");
        let state = Arc::new(Mutex::new(None));
        let (folder, shared) = (folder.to_owned(), Arc::clone(&state));
        std::thread::spawn(move || {
            for stream in listener.incoming().flatten() {
                let (folder, shared) = (folder.clone(), Arc::clone(&shared));
                std::thread::spawn(move || answer(stream, &folder, &shared));
            }
        });
        Self {
            address: format!("http://{address}/"),
            state,
        }
    }

    pub fn state(&self) -> Option<State> {
        self.state.lock().expect("no thread panicked").clone()
    }
}

/// Answers one request, and closes the connection.
fn answer(mut stream: TcpStream, folder: &Path, state: &Mutex<Option<State>>) -> Option<()> {
    let mut reader = BufReader::new(stream.try_clone().ok()?);
    let mut line = String::new();
    reader.read_line(&mut line).ok()?;
    let mut words = line.split_whitespace();
    let (method, path) = (words.next()?.to_owned(), words.next()?.to_owned());
    let mut length = 0;
    loop {
        let mut header = String::new();
        reader.read_line(&mut header).ok()?;
        let header = header.trim().to_ascii_lowercase();
        if header.is_empty() {
            break;
        }
        if let Some(value) = header.strip_prefix("content-length:") {
            length = value.trim().parse().ok()?;
        }
    }
    let mut body = Vec::new();
    if method == "POST" {
        body.resize(length, 0);
        reader.read_exact(&mut body).ok()?;
        let about = path.split_once('?')?.1;
        let mut parts = about.splitn(3, ',');
        let mut number = || parts.next()?.parse().ok();
        let indirect = [number()?, number()?];
        let title = parts
            .next()?
            .replace("%3A", ":")
            .replace("%20", " ")
            .replace("%2C", ",");
        let picture = image::load_from_memory(&body).ok()?.into_rgb8();
        *state.lock().ok()? = Some(State {
            title,
            picture,
            indirect,
        });
        body.clear();
    } else {
        let name = path.trim_start_matches('/');
        let file = folder.join(if name.is_empty() { "index.html" } else { name });
        body = read(&file).unwrap_or_default();
    }
    let kind = match path.rsplit('.').next() {
        Some("js") => "text/javascript",
        Some("json") => "application/json",
        Some("png") => "image/png",
        Some("glb") => "model/gltf-binary",
        _ => "text/html; charset=utf-8",
    };
    let length = body.len();
    let head = format!(
        "HTTP/1.1 200 OK\r\nContent-Type: {kind}\r\nContent-Length: {length}\r\n\
         Connection: close\r\n\r\n"
    );
    stream.write_all(head.as_bytes()).ok()?;
    stream.write_all(&body).ok()
}

fn read(file: &PathBuf) -> Option<Vec<u8>> {
    let mut bytes = std::fs::read(file).ok()?;
    if file.ends_with("index.html") {
        bytes.extend_from_slice(REPORT.as_bytes());
    }
    Some(bytes)
}
