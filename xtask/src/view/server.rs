//! A page for a browser on this machine.

use crate::console::Console;
use anyhow::{Context, Result};
use farfield_bundle::NewFile;
use oxhttp::model::header::{CACHE_CONTROL, CONTENT_TYPE, X_CONTENT_TYPE_OPTIONS};
use oxhttp::model::{Body, Method, Response, StatusCode};
use oxhttp::{ListeningServer, Server};
use std::collections::BTreeMap;
use std::net::{Ipv4Addr, SocketAddr, TcpListener};

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
    let (server, address) = start(files, port)?;
    console.say(format_args!("  http://{address}/ until Ctrl-C"));
    Ok(server.join()?)
}

/// Starts to serve, in threads of its own.
pub(super) fn start(files: Vec<NewFile>, port: u16) -> Result<(ListeningServer, SocketAddr)> {
    let address = free(port).with_context(|| taken(port))?;
    let files = files.into_iter().map(|file| (file.path, file.bytes));
    let files: BTreeMap<String, Vec<u8>> = files.collect();
    let server = Server::new(move |request| {
        let is_get = *request.method() == Method::GET;
        answer(&files, is_get, request.uri().path())
    });
    let server = server.bind(address).spawn().with_context(|| taken(port))?;
    Ok((server, address))
}

/// An address of this machine that is free; the server itself does not tell which it found.
fn free(port: u16) -> std::io::Result<SocketAddr> {
    TcpListener::bind((Ipv4Addr::LOCALHOST, port))?.local_addr()
}

fn taken(port: u16) -> String {
    format!("cannot serve on 127.0.0.1:{port}: choose another --port")
}

fn answer(files: &BTreeMap<String, Vec<u8>>, is_get: bool, path: &str) -> Response<Body> {
    let empty = |status: StatusCode| {
        let mut response = Response::new(Body::empty());
        *response.status_mut() = status;
        response
    };
    if !is_get {
        return empty(StatusCode::METHOD_NOT_ALLOWED);
    }
    let path = match path.strip_prefix('/') {
        Some("") => "index.html",
        Some(path) => path,
        None => path,
    };
    let Some(bytes) = files.get(path) else {
        return empty(StatusCode::NOT_FOUND);
    };
    Response::builder()
        .header(CONTENT_TYPE, content_type(path))
        // The next bundle may have the same address.
        .header(CACHE_CONTROL, "no-store")
        .header(X_CONTENT_TYPE_OPTIONS, "nosniff")
        .body(Body::from(bytes.clone()))
        .expect("names and values are those of headers")
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
