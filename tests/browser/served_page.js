// The built page on a server of its own, in Chromium, with its state log: shared by the scripts that work in it.

const fs = require('fs');
const http = require('http');
const path = require('path');

/** Time for which a value of the state log is awaited, ms. */
const PATIENCE = 180000;

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.png': 'image/png', '.webmanifest': 'application/manifest+json' };

const ADAPTERS = {
  webgl: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-features=WebGPU'],
  webgpu: ['--enable-unsafe-webgpu', '--enable-features=Vulkan,WebGPU', '--use-webgpu-adapter=swiftshader', '--use-gl=angle',
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
};

const started = Date.now();
const wrong = [];
/** Prints at once, so that a test that waits in vain says why. */
const tell = what => console.error(`${((Date.now() - started) / 1000).toFixed(1)} s: ${what}`);
const complain = what => { wrong.push(what); tell(what); };
const claim = (holds, what) => { if (!holds) complain(what); };

const serve = async folder => {
  const server = http.createServer((request, response) => {
    const name = new URL(request.url, 'http://page').pathname.replace(/^\/$/, '/index.html');
    const file = path.join(folder, path.normalize(name));
    if (!fs.existsSync(file)) return response.writeHead(404).end();
    // The headers that docs/it.md asks a school's server for.
    response.writeHead(200, {
      'content-type': TYPES[path.extname(file)] || 'application/octet-stream',
      'cache-control': /-[0-9a-f]{12}\.(js|wasm)$/.test(file) ? 'public, max-age=31536000, immutable' : 'no-cache',
      'content-security-policy': "frame-ancestors 'self'", 'x-content-type-options': 'nosniff', 'referrer-policy': 'no-referrer',
    }).end(fs.readFileSync(file));
  });
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  return server;
};

/**
 * Opens a browser with an empty page, and serves the page of a folder. Complains about errors, dialogs, and whatever is asked from
 * another server. `state` holds the newest value of each topic of the state log; `until` waits for one.
 */
const open = async ({ playwright, executablePath, folder, adapter }) => {
  const server = await serve(folder);
  const address = `http://127.0.0.1:${server.address().port}/`;
  const { chromium } = require(playwright);
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', ...ADAPTERS[adapter]] });
  const context = await browser.newContext({ viewport: { width: 1280, height: 780 }, locale: 'en-GB', acceptDownloads: true });
  await context.route(url => !url.href.startsWith(address) && !/^(data|blob):/.test(url.protocol),
    route => { complain(`asked for ${route.request().url()}`); route.abort(); });
  const state = {};
  let heard = () => {};
  const newPage = async () => {
    const page = await context.newPage();
    page.on('console', message => {
      const line = message.text();
      if (line.startsWith('typodont: ')) {
        const [, topic, value] = line.match(/^typodont: (\S+) ?(.*)$/s);
        if (topic === 'screen' && value !== state[topic]) tell(`screen ${value}`);
        state[topic] = value;
        heard();
      } else if (message.type() === 'error') {
        complain(`logged: ${line}`);
      }
    });
    page.on('pageerror', error => complain(`thrown: ${error.stack || error.message}`));
    page.on('crash', () => complain('the page crashed'));
    page.on('dialog', dialog => { complain(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
    await page.addInitScript(() => localStorage.setItem('typodont.settings', '{ "introduction_first": false }'));
    return page;
  };

  /** Waits until a topic of the state log has a value that the condition accepts. */
  const until = async (topic, condition) => {
    const end = Date.now() + PATIENCE;
    while (!(topic in state && condition(state[topic]))) {
      if (Date.now() > end) throw new Error(`${topic} stays ${state[topic]}; ${JSON.stringify(state)}`);
      await Promise.race([new Promise(done => { heard = done; }), new Promise(done => setTimeout(done, 1000))]);
    }
    return state[topic];
  };
  const click = async mark => {
    const at = (await until('marks', marks => marks.includes(`${mark}=`))).match(new RegExp(`${mark.replace('.', '\\.')}=(\\d+),(\\d+)`));
    await opened.page.mouse.click(Number(at[1]), Number(at[2]));
  };
  /** Closes the page as a system ends a tab, without a question, and opens another one. */
  const reopen = async query => {
    await opened.page.close({ runBeforeUnload: false });
    Object.keys(state).forEach(topic => delete state[topic]);
    opened.page = await newPage();
    await opened.page.goto(`${address}${query}`);
  };
  const close = async () => { await browser.close(); server.close(); };
  const opened = { page: await newPage(), context, server, address, state, until, click, reopen, close };
  return opened;
};

/** Runs a script's work; exits with 1 and a line per claim that did not hold. */
const main = work => work().then(() => { if (wrong.length) throw new Error(wrong.join('\n')); })
  .catch(error => { console.error(error.stack || error); process.exit(1); });

module.exports = { PATIENCE, claim, complain, main, open, tell };
