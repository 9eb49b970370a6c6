// The built page on a server of its own, in Chromium, with its state log: shared by the scripts that work in it.

const { execFileSync } = require('child_process');
const fs = require('fs');
const http = require('http');
const os = require('os');
const path = require('path');

/** Time for which a value of the state log is awaited, ms. */
const PATIENCE = 180000;

/** Ticks of a session that may be lost with a page: a second. */
const LOST_MAX = 1000;

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.png': 'image/png', '.webmanifest': 'application/manifest+json' };

const ADAPTERS = {
  webgl: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-features=WebGPU'],
  webgpu: ['--enable-unsafe-webgpu', '--enable-features=Vulkan', '--use-webgpu-adapter=swiftshader', '--use-vulkan=swiftshader',
    '--use-angle=swiftshader', '--disable-vulkan-surface', '--ignore-gpu-blocklist', '--enable-unsafe-swiftshader'],
};

const started = Date.now();
const wrong = [];
/** Prints at once, so that a test that waits in vain says why. */
const tell = what => console.error(`${((Date.now() - started) / 1000).toFixed(1)} s: ${what}`);
const complain = what => { wrong.push(what); tell(what); };
const claim = (holds, what) => { if (!holds) complain(what); };

const serve = async (folder, exercises) => {
  const server = http.createServer((request, response) => {
    const name = path.normalize(new URL(request.url, 'http://page').pathname.replace(/^\/$/, '/index.html'));
    const file = exercises && name.startsWith('/exercises/') ? path.join(exercises, path.basename(name)) : path.join(folder, name);
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

/** A browser's profile in which pages may keep nothing, as where a school or a user blocks it. */
const blockedProfile = () => {
  const profile = fs.mkdtempSync(path.join(os.tmpdir(), 'blocked-'));
  fs.mkdirSync(path.join(profile, 'Default'));
  const preferences = { profile: { default_content_setting_values: { cookies: 2 } } };
  fs.writeFileSync(path.join(profile, 'Default', 'Preferences'), JSON.stringify(preferences));
  return profile;
};

/**
 * Opens a browser with an empty page, and serves the page of a folder, and the exercises of another one below `exercises/`. Complains
 * about errors, dialogs, and whatever is asked from another server. `state` holds the newest value of each topic of the state log;
 * `until` waits for one. WebGPU needs a display. `mayFail` says which errors in the browser's log are expected.
 */
const open = async ({ playwright, executablePath, folder, adapter, exercises, isBlocked = false, mayFail = /^$/ }) => {
  const server = await serve(folder, exercises);
  const address = `http://127.0.0.1:${server.address().port}/`;
  const { chromium } = require(playwright);
  // Without a display, Chromium draws WebGPU's canvases all white.
  const launch = { executablePath, headless: adapter !== 'webgpu', args: ['--no-sandbox', ...ADAPTERS[adapter]] };
  const view = { viewport: { width: 1280, height: 780 }, locale: 'en-GB', acceptDownloads: true };
  const profile = isBlocked ? blockedProfile() : undefined;
  const browser = isBlocked ? undefined : await chromium.launch(launch);
  const context = isBlocked ? await chromium.launchPersistentContext(profile, { ...launch, ...view }) : await browser.newContext(view);
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
      } else if (message.type() === 'error' && !mayFail.test(line)) {
        complain(`logged: ${line}`);
      }
    });
    page.on('pageerror', error => { if (!mayFail.test(error.message)) complain(`thrown: ${error.stack || error.message}`); });
    page.on('crash', () => complain('the page crashed'));
    page.on('dialog', dialog => { complain(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
    await page.addInitScript(() => {
      try { localStorage.setItem('typodont.settings', '{ "introduction_first": false }'); } catch { /* blocked */ }
    });
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
  /** Waits until a mark is on the screen, and returns its place. */
  const placeOf = async mark => {
    const find = marks => marks.match(new RegExp(`(?:^| )${mark.replace(/[.*+?^${}()|[\]\\]/g, '\\$&')}=(\\d+),(\\d+)`));
    const [, x, y] = find(await until('marks', find));
    return [Number(x), Number(y)];
  };
  const click = async mark => opened.page.mouse.click(...await placeOf(mark));
  /** Closes the page as a system ends a tab, without a question, and opens another one. */
  const reopen = async query => {
    await opened.page.close({ runBeforeUnload: false });
    Object.keys(state).forEach(topic => delete state[topic]);
    opened.page = await newPage();
    await opened.page.goto(`${address}${query}`);
  };
  const close = async () => {
    await (browser ?? context).close();
    server.close();
    if (profile) fs.rmSync(profile, { recursive: true });
  };
  const opened = { page: await newPage(), browser, context, server, address, state, until, placeOf, click, newPage, reopen, close };
  return opened;
};

/** Opens an exercise of the list, up to the moment in which the instrument follows the mouse, or up to the end of `opened.begin`. */
const openExercise = async (opened, exercise, atBriefing = async () => {}, atTask = async () => {}) => {
  const { page, state, until, click, begin = atTask => takeInstrument(opened, atTask) } = opened;
  await page.mouse.move(640, 400);
  while (state.chosen !== exercise) {
    const before = state.chosen;
    await page.keyboard.press('ArrowDown');
    await until('chosen', chosen => chosen !== before);
  }
  await click('shelf.open');
  await until('screen', screen => screen === 'briefing');
  await atBriefing();
  await click('briefing.begin');
  await begin(atTask);
};

/** Begins the lesson of a briefing, up to the moment in which the instrument follows the mouse. */
const beginLesson = async (opened, atTask) => {
  await opened.click('briefing.begin');
  await takeInstrument(opened, atTask);
};

/** Waits for a lesson to begin, and lets the instrument follow the mouse. */
const takeInstrument = async ({ page, until }, atTask = async () => {}) => {
  await until('screen', screen => screen === 'practice');
  await until('hand', () => true);
  await until('clock', clock => clock === 'stopped');
  await atTask();
  await page.keyboard.press('o');
  await until('pointer', pointer => pointer === 'held');
};

/** Moves the mouse in circles and presses, for a time in ms. */
const moveAbout = async (page, time) => {
  const end = Date.now() + time;
  for (let at = 0; Date.now() < end; at += 1) {
    await page.mouse.move(640 + 60 * Math.cos(at), 400 + 60 * Math.sin(at), { steps: 3 });
    await page.mouse.down();
    await page.waitForTimeout(300);
    await page.mouse.up();
  }
};

/** Ends a lesson before its time; resolves with the moment in which that was confirmed. */
const finishLesson = async ({ page, state, until }) => {
  // With the instrument put down, Esc would ask whether the exercise is to end.
  if (state.pointer === 'held') await page.keyboard.press('Escape');
  await until('pointer', pointer => pointer === 'free');
  let ended;
  while (state.screen === 'practice') {
    await page.keyboard.press('Control+Enter');
    await until('asked', asked => asked === 'finish');
    ended = Date.now();
    await page.keyboard.press('Enter');
    await Promise.race([until('asked', asked => asked === 'nothing'), until('screen', screen => screen !== 'practice')]);
    await page.waitForTimeout(500);
  }
  // The questionnaire, where it is asked, is handed in without answers, which is asked once again.
  while (state.screen === 'questionnaire') {
    await page.keyboard.press('Control+Enter');
    await page.waitForTimeout(700);
  }
  return ended;
};

/** Waits for the bundle of a finished session, and saves it as a ZIP file. */
const saveBundle = async ({ page, state, until, click }, zip) => {
  await until('screen', screen => screen === 'results');
  await until('bundle', () => true);
  const waiting = page.waitForEvent('download', { timeout: PATIENCE });
  await click('results.download');
  const download = await waiting;
  await download.saveAs(zip);
  claim(download.suggestedFilename() === `${state.bundle}.zip`, `the bundle is saved as ${download.suggestedFilename()}`);
};

/** Runs a script's work; exits with 1 and a line per claim that did not hold, and at once, whatever is still waited for. */
const main = work => work().then(() => { if (wrong.length) throw new Error(wrong.join('\n')); process.exit(0); })
  .catch(error => { console.error(error.stack || error); process.exit(1); });

/** The result in the ZIP file of a bundle. */
const sessionOf = zip => JSON.parse(execFileSync('unzip', ['-p', zip, '*/session.json'], { maxBuffer: 1 << 26 }));

module.exports = {
  LOST_MAX, PATIENCE, beginLesson, claim, complain, finishLesson, main, moveAbout, open, openExercise, saveBundle, sessionOf,
  takeInstrument, tell,
};
