//! A page for a browser on this machine.

use crate::console::Console;
use anyhow::{Context, Result, anyhow};
use farfield_bundle::NewFile;
use std::collections::BTreeMap;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use tiny_http::{Header, Method, Request, Response, Server};

/// Serves files by their paths, `index.html` as the root too, to programs on this machine, and says
/// where, until the program is ended.
///
/// Nothing is read from disk: there are no other files than these, whatever path is asked for.
///
/// * `port` - 0 takes one that is free
///
/// # Errors
///
/// When the port is taken.
pub fn serve(files: Vec<NewFile>, port: u16, console: &Console) -> Result<()> {
    let (server, address) = bind(port)?;
    console.say(format_args!("  http://{address}/ until Ctrl-C"));
    answer_all(&server, files);
    Ok(())
}

/// Takes a port of the loopback interface.
pub(super) fn bind(port: u16) -> Result<(Server, SocketAddr)> {
    let address = SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port);
    let server = Server::http(address)
        .map_err(|error| anyhow!(error))
        .with_context(|| format!("cannot serve on {address}: choose another --port"))?;
    let address = server.server_addr().to_ip().unwrap_or(address);
    Ok((server, address))
}

/// Answers requests until the server is unblocked.
pub(super) fn answer_all(server: &Server, files: Vec<NewFile>) {
    let files = files.into_iter().map(|file| (file.path, file.bytes));
    let files: BTreeMap<String, Vec<u8>> = files.collect();
    for request in server.incoming_requests() {
        // A browser that went away needs no answer.
        let _ = answer(request, &files);
    }
}

fn answer(request: Request, files: &BTreeMap<String, Vec<u8>>) -> std::io::Result<()> {
    if !matches!(request.method(), Method::Get | Method::Head) {
        return request.respond(Response::empty(405));
    }
    let path = request.url().split(['?', '#']).next().unwrap_or_default();
    let path = match path.strip_prefix('/') {
        Some("") => "index.html",
        Some(path) => path,
        None => "",
    };
    let Some(bytes) = files.get(path) else {
        return request
            .respond(Response::from_string("there is no such file").with_status_code(404));
    };
    let mut response = Response::from_data(bytes.as_slice());
    // The next bundle may have the same address.
    for (name, value) in [
        ("Content-Type", content_type(path)),
        ("Cache-Control", "no-store"),
        ("X-Content-Type-Options", "nosniff"),
    ] {
        let header = Header::from_bytes(name, value).expect("names and values are ASCII");
        response.add_header(header);
    }
    request.respond(response)
}

fn content_type(path: &str) -> &'static str {
    match path.rsplit('.').next() {
        Some("html") => "text/html; charset=utf-8",
        Some("css") => "text/css; charset=utf-8",
        Some("js") => "text/javascript; charset=utf-8",
        Some("json") => "application/json",
        Some("png") => "image/png",
        Some("glb") => "model/gltf-binary",
        _ => "application/octet-stream",
    }
}
