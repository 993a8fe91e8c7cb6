// Finds a browser and the driver, and serves a folder to it.

import { execFileSync, spawn } from 'node:child_process';
import { existsSync, readFileSync, statSync } from 'node:fs';
import { createServer } from 'node:http';
import { join, normalize } from 'node:path';
import { fileURLToPath } from 'node:url';
import puppeteer from 'puppeteer-core';

const PLACES = [
  '/usr/bin/chromium',
  '/usr/bin/chromium-browser',
  '/usr/bin/google-chrome',
  '/Applications/Google Chrome.app/Contents/MacOS/Google Chrome',
  '/Applications/Chromium.app/Contents/MacOS/Chromium',
  'C:\\Program Files\\Google\\Chrome\\Application\\chrome.exe',
];

/** The browser named by CHROMIUM, or one in the usual places; undefined where there is none. */
export function browserPath() {
  return process.env.CHROMIUM || PLACES.find((path) => existsSync(path));
}

/** Starts a browser that draws in software, so that pictures depend on no driver. */
export function launch(executablePath) {
  return puppeteer.launch({
    executablePath,
    headless: true,
    args: [
      '--no-sandbox',
      '--use-gl=angle',
      '--use-angle=swiftshader',
      '--enable-unsafe-swiftshader',
      '--force-color-profile=srgb',
      '--no-first-run',
      '--disable-background-networking',
      '--disable-component-update',
      '--disable-sync',
    ],
  });
}

const ROOT = fileURLToPath(new URL('../..', import.meta.url));

/** `cargo xtask`, or the program named by FARFIELD_XTASK, and its first arguments. */
const driver = () => {
  const own = process.env.FARFIELD_XTASK;
  return own ? [own, []] : ['cargo', ['xtask']];
};

/** Runs the driver with arguments. */
export function xtask(...args) {
  const [program, first] = driver();
  execFileSync(program, [...first, ...args], { cwd: ROOT, stdio: ['ignore', 'inherit', 'pipe'] });
}

/** Lets the driver serve a bundle; returns the address that it tells and what ends it. */
export async function view(bundle) {
  const [program, first] = driver();
  const stdio = ['ignore', 'inherit', 'pipe'];
  const running = spawn(program, [...first, 'view', bundle, '--web'], { cwd: ROOT, stdio });
  let said = '';
  const address = await new Promise((done, fail) => {
    running.stderr.on('data', (text) => {
      said += text;
      const found = said.match(/http:\/\/[0-9.:]+\//);
      if (found) done(found[0]);
    });
    running.on('exit', () => fail(new Error(said)));
  });
  return { address, close: () => running.kill() };
}

const TYPES = { html: 'text/html', js: 'text/javascript', css: 'text/css', png: 'image/png' };

/** Serves a folder on this machine; returns its address and what ends it. */
export async function serve(folder) {
  const server = createServer((request, response) => {
    const path = join(folder, normalize(new URL(request.url, 'http://localhost').pathname));
    const file = path.endsWith('/') ? `${path}index.html` : path;
    if (!existsSync(file) || !statSync(file).isFile()) {
      response.writeHead(404).end();
      return;
    }
    const type = TYPES[file.split('.').pop()] ?? 'application/octet-stream';
    response.writeHead(200, { 'Content-Type': type }).end(readFileSync(file));
  });
  await new Promise((done) => server.listen(0, '127.0.0.1', done));
  const { port } = server.address();
  return { address: `http://127.0.0.1:${port}/`, close: () => server.close() };
}
