// Goes through a lesson in the page as a trainee does, with a real mouse, from the shelf to a downloaded bundle.
//
//     node page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES BUNDLE.zip webgl|webgpu
//
// Serves the folder PAGE itself. Prints `seed N` once the exercise has begun, and reads the place of the caries, `x y z` in mm,
// from its input. Then prints what it measured as JSON. Exits with 1 and a line per claim that does not hold.

const fs = require('fs');
const http = require('http');
const path = require('path');
const readline = require('readline');

const [playwright, executablePath, folder, pictures, zip, adapter] = process.argv.slice(2);
const { chromium } = require(playwright);

const PATIENCE = 180000;
const wrong = [];
const claim = (holds, what) => { if (!holds) wrong.push(what); };

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.wasm': 'application/wasm', '.png': 'image/png' };
const server = http.createServer((request, response) => {
  const name = new URL(request.url, 'http://page').pathname.replace(/^\/$/, '/index.html');
  const file = path.join(folder, path.normalize(name));
  if (!fs.existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { 'content-type': TYPES[path.extname(file)] || 'application/octet-stream' }).end(fs.readFileSync(file));
});

const ADAPTERS = {
  webgl: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-features=WebGPU'],
  webgpu: ['--enable-unsafe-webgpu', '--enable-features=Vulkan,WebGPU', '--use-webgpu-adapter=swiftshader', '--use-gl=angle',
    '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
};

const state = {};
let heard = () => {};
/** Waits until a topic of the state log has a value that the condition accepts. */
const until = async (topic, condition) => {
  const end = Date.now() + PATIENCE;
  while (!(topic in state && condition(state[topic]))) {
    if (Date.now() > end) throw new Error(`${topic} stays ${state[topic]}; ${JSON.stringify(state)}`);
    await Promise.race([new Promise(done => { heard = done; }), new Promise(done => setTimeout(done, 1000))]);
  }
  return state[topic];
};

const numbers = text => text.split(' ').map(Number);

/** A vector of the world as one sees it in the picture: right, up, toward the eye. */
const inView = ([x, y, z]) => {
  const [azimuth, elevation] = numbers(state.view);
  const [c, s] = [Math.cos(azimuth), Math.sin(azimuth)];
  [x, z] = [c * x - s * z, s * x + c * z];
  const [d, t] = [Math.cos(elevation), Math.sin(elevation)];
  return [x, d * y - t * z, t * y + d * z];
};

(async () => {
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  const address = `http://127.0.0.1:${server.address().port}/`;
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox', ...ADAPTERS[adapter]] });
  const context = await browser.newContext({ viewport: { width: 1280, height: 780 }, locale: 'en-GB', acceptDownloads: true });
  await context.route(url => !url.href.startsWith(address) && !/^(data|blob):/.test(url.protocol), route => { wrong.push(`asked for ${route.request().url()}`); route.abort(); });
  const page = await context.newPage();
  page.on('console', message => {
    const line = message.text();
    if (line.startsWith('typodont: ')) {
      const [, topic, value] = line.match(/^typodont: (\S+) ?(.*)$/s);
      state[topic] = value;
      heard();
    } else if (message.type() === 'error') {
      wrong.push(`logged: ${line}`);
    }
  });
  page.on('pageerror', error => wrong.push(`thrown: ${error.message}`));
  page.on('dialog', dialog => { wrong.push(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
  await page.addInitScript(() => localStorage.setItem('typodont.settings', '{ "introduction_first": false }'));
  const picture = name => page.screenshot({ path: path.join(pictures, `page-${adapter}-${name}.png`) });
  const press = async (key, topic, value) => { await page.keyboard.press(key); await until(topic, now => now === value); };
  const click = async mark => {
    const at = (await until('marks', marks => marks.includes(`${mark}=`))).match(new RegExp(`${mark.replace('.', '\\.')}=(\\d+),(\\d+)`));
    await page.mouse.click(Number(at[1]), Number(at[2]));
  };

  const began = Date.now();
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  const shown_ms = Date.now() - began;
  await page.mouse.move(640, 400);
  await picture('1-shelf');
  claim((await page.$('#status')) === null, 'the status is removed once the program draws');
  for (const chosen of ['2-decay', '3-detection', '4-diagnosis', '5-grinding']) await press('ArrowDown', 'chosen', chosen);
  await click('shelf.open');
  await until('screen', screen => screen === 'briefing');
  await picture('2-briefing');
  await click('briefing.begin');
  const making = Date.now();
  await until('screen', screen => screen === 'practice');
  await until('hand', () => true);
  const made_ms = Date.now() - making;
  await until('clock', clock => clock === 'stopped');
  console.log(`seed ${state.seed}`);
  const goal = numbers(await new Promise(done => readline.createInterface({ input: process.stdin }).once('line', done)));
  await picture('3-task');
  await press('o', 'pointer', 'held');

  let at = [640, 400];
  const move = async (right, down) => {
    at = [Math.min(1100, Math.max(60, at[0] + right)), Math.min(740, Math.max(60, at[1] + down))];
    await page.mouse.move(...at, { steps: 4 });
  };
  /** Moves the mouse until the hand is over or under a place of the world, as one sees it in the picture. */
  const pointAt = async place => {
    const end = Date.now() + PATIENCE;
    await move(4, 3);
    for (;;) {
      await page.waitForTimeout(250);
      const hand = numbers(state.hand);
      const [right, up] = inView(place.map((goal, i) => goal - hand[i]));
      if (Math.hypot(right, up) < 0.4) return;
      if (Date.now() > end) throw new Error(`the hand stays at ${hand}, away from ${place}`);
      const pixels = mm => Math.max(-120, Math.min(120, Math.round(8 * mm)));
      await move(pixels(right), pixels(-up));
    }
  };
  await pointAt(goal);
  const cutting = Date.now();
  const [ticks, frames] = [Number(state.ticks), Number(state.frames)];
  for (let round = 0; round < 40 && Number(state.cleared) < 10; round += 1) {
    const angle = 0.8 * round;
    await pointAt([goal[0] + 0.6 * Math.cos(angle), goal[1], goal[2] + 0.6 * Math.sin(angle)]);
    await page.mouse.down();
    await page.waitForTimeout(1500);
    if (round === 1) await picture('4-cutting');
    await page.mouse.up();
  }
  const cutting_s = (Date.now() - cutting) / 1000;
  const pace = { ticks_per_s: (Number(state.ticks) - ticks) / cutting_s, frames_per_s: (Number(state.frames) - frames) / cutting_s };
  claim(Number(state.cleared) >= 10, `${state.cleared} % of the caries is removed`);
  const late = state.late;
  await press('Escape', 'pointer', 'free');
  await picture('5-cut');
  await press('Control+Enter', 'asked', 'finish');
  const ended = Date.now();
  await page.keyboard.press('Enter');
  await until('screen', screen => screen === 'results');
  await until('bundle', () => true);
  const completed_ms = Date.now() - ended;
  await page.waitForTimeout(1000);
  await picture('6-results');

  const waiting = page.waitForEvent('download', { timeout: PATIENCE });
  await click('results.download');
  const download = await waiting;
  await download.saveAs(zip);
  claim(download.suggestedFilename() === `${state.bundle}.zip`, `the bundle is saved as ${download.suggestedFilename()}`);

  // The report opens from the page, with its own script.
  const opening = context.waitForEvent('page', { timeout: PATIENCE });
  await page.keyboard.press('r');
  const report = await opening;
  await report.waitForFunction(() => document.documentElement.dataset.shown, null, { timeout: PATIENCE });
  await report.screenshot({ path: path.join(pictures, `page-${adapter}-7-report.png`) });
  await browser.close();
  server.close();
  console.log(JSON.stringify({ adapter, shown_ms, made_ms, completed_ms, late, ...pace }));
  if (wrong.length) throw new Error(wrong.join('\n'));
})().catch(error => { console.error(error.stack || error); process.exit(1); });
