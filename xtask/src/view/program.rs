//! The page itself: built from the folder `web` by npm when that is needed.

use crate::console::Console;
use anyhow::{Context, Result, anyhow, bail};
use farfield_bundle::NewFile;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::SystemTime;

/// The page's files, built before where they are not there or older than what they are made of.
///
/// # Errors
///
/// When Node.js or npm are missing, or the build fails.
pub fn built(console: &Console) -> Result<Vec<NewFile>> {
    let web = Path::new(env!("CARGO_MANIFEST_DIR")).join("../web");
    let dist = web.join("dist");
    let sources = newest(&sources(&web)?)?;
    let made = finished(&dist);
    if made.is_none_or(|made| made < sources) {
        build(&web, console)?;
    }
    read(&dist)
}

/// Files that the page is made of.
fn sources(web: &Path) -> Result<Vec<PathBuf>> {
    let own = ["package.json", "package-lock.json", "build.js"].map(|name| web.join(name));
    Ok(own.into_iter().chain(files_in(&web.join("src"))?).collect())
}

fn build(web: &Path, console: &Console) -> Result<()> {
    let installed = modified(&web.join("node_modules/.package-lock.json")).ok();
    let wanted = modified(&web.join("package-lock.json"))?;
    if installed.is_none_or(|installed| installed < wanted) {
        console.say("  npm ci: fetches what the page is built with");
        npm(web, &["ci", "--omit=dev", "--no-fund", "--no-audit"])?;
    }
    console.say("  npm run build: builds the page");
    npm(web, &["run", "--silent", "build"])
}

/// Runs npm in the folder.
fn npm(web: &Path, arguments: &[&str]) -> Result<()> {
    let program = if cfg!(windows) { "npm.cmd" } else { "npm" };
    let command = || format!("npm {} in {}", arguments.join(" "), web.display());
    let output = Command::new(program)
        .args(arguments)
        .current_dir(web)
        .output()
        .map_err(|error| match error.kind() {
            std::io::ErrorKind::NotFound => anyhow!(
                "npm is not there: the page of `view --web` is built by Node.js 18 or newer and npm, \
                 once; install them (Debian: apt install nodejs npm), or let somebody who has them \
                 send you what `view --web --export` writes, which needs neither"
            ),
            _ => anyhow!(error).context(command()),
        })?;
    if !output.status.success() {
        let said = [&output.stdout[..], &output.stderr[..]].concat();
        let said = String::from_utf8_lossy(&said);
        bail!("{} failed: {}", command(), said.trim());
    }
    Ok(())
}

/// When the last of some files was changed.
fn newest(files: &[PathBuf]) -> Result<SystemTime> {
    let mut newest = SystemTime::UNIX_EPOCH;
    for file in files {
        newest = newest.max(modified(file)?);
    }
    Ok(newest)
}

/// What a page is not shown without.
const NEEDED: [&str; 3] = ["index.html", "page.js", "style.css"];

/// When the first of the files that a page needs was written; `None` where one is not there.
fn finished(dist: &Path) -> Option<SystemTime> {
    let mut first = None;
    for name in NEEDED {
        let written = modified(&dist.join(name)).ok()?;
        first = Some(first.map_or(written, |first: SystemTime| first.min(written)));
    }
    first
}

fn modified(path: &Path) -> Result<SystemTime> {
    let metadata = std::fs::metadata(path).and_then(|metadata| metadata.modified());
    metadata.with_context(|| path.display().to_string())
}

/// The files of a folder, ordered by name.
fn files_in(dir: &Path) -> Result<Vec<PathBuf>> {
    let entries = std::fs::read_dir(dir).with_context(|| dir.display().to_string())?;
    let mut files = entries
        .map(|entry| Ok(entry?.path()))
        .collect::<Result<Vec<_>>>()?;
    files.sort();
    Ok(files)
}

fn read(dist: &Path) -> Result<Vec<NewFile>> {
    let files = files_in(dist)?.into_iter().map(|path| {
        let bytes = std::fs::read(&path).with_context(|| path.display().to_string())?;
        let name = path.file_name().unwrap_or_default().to_string_lossy();
        Ok(NewFile {
            path: name.into_owned(),
            bytes,
        })
    });
    files.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A page that lacks a file, as builds that were interrupted have left them, is built again.
    #[test]
    fn a_page_without_its_script_is_not_finished() {
        let folder = tempfile::tempdir().unwrap();
        let write = |name: &str| std::fs::write(folder.path().join(name), name).unwrap();
        assert_eq!(finished(&folder.path().join("dist")), None);
        write("index.html");
        write("style.css");
        assert_eq!(finished(folder.path()), None);
        write("page.js");
        let first = modified(&folder.path().join("index.html")).unwrap();
        assert_eq!(finished(folder.path()), Some(first));
    }
}
