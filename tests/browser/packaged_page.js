// Performs an exercise of a SCORM 1.2 package with the program's own page, in the frame of a platform whose run-time is scorm-again.
//
//     node packaged_page.js PLAYWRIGHT-CORE CHROMIUM SCORM-AGAIN PACKAGE BUNDLE.zip
//
// PACKAGE is a folder with the archive's files. Saves the bundle that the learner would hand in. Exits with 1 and a line per claim that
// does not hold.

const crypto = require('crypto');
const fs = require('fs');
const http = require('http');
const path = require('path');

const [playwright, executablePath, scormAgain, folder, zip] = process.argv.slice(2);
const { chromium } = require(playwright);

const PATIENCE = 240000;
const LEARNER = 'student@school.example';
const started = Date.now();
const wrong = [];
const tell = what => console.error(`${((Date.now() - started) / 1000).toFixed(1)} s: ${what}`);
const complain = what => { wrong.push(what); tell(what); };
const claim = (holds, what) => { if (!holds) complain(what); };

const PLATFORM = `<!DOCTYPE html><title>Platform</title><style>body { margin: 0 }</style><script src="/scorm-again/scorm12.js"></script><script>
  window.API = new Scorm12API({ autocommit: false, logLevel: 5 });
  API.loadFromJSON({ core: { student_id: '${LEARNER}', lesson_mode: 'normal', lesson_status: 'not attempted' },
    student_preference: { language: 'tr' } }, 'cmi');
</script><iframe id="content" src="/course/launch.html?exercise=0" style="border: 0; width: 100vw; height: 100vh"></iframe>`;

const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.json': 'application/json', '.wasm': 'application/wasm', '.png': 'image/png' };
const server = http.createServer((request, response) => {
  const { pathname, search } = new URL(request.url, 'http://localhost');
  if (pathname === '/favicon.ico') return response.writeHead(204).end();
  if (pathname === '/platform.html') return response.writeHead(200, { 'content-type': 'text/html' }).end(PLATFORM);
  // The state of the page is read from its log, which its address must ask for.
  if (pathname === '/course/page/index.html' && !search.includes('state-log')) {
    return response.writeHead(302, { location: `${pathname}${search}&state-log` }).end();
  }
  const isCourse = pathname.startsWith('/course/');
  const file = isCourse ? path.join(folder, pathname.slice(8)) : path.join(scormAgain, pathname.replace('/scorm-again/', ''));
  if (!fs.existsSync(file)) return response.writeHead(404).end();
  response.writeHead(200, { 'content-type': TYPES[path.extname(file)] || 'application/octet-stream' }).end(fs.readFileSync(file));
});

const state = {};
const until = async (topic, condition) => {
  const end = Date.now() + PATIENCE;
  while (!(topic in state && condition(state[topic]))) {
    if (Date.now() > end) throw new Error(`${topic} stays ${state[topic]}; ${JSON.stringify(state)}`);
    await new Promise(done => setTimeout(done, 100));
  }
};

(async () => {
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  const browser = await chromium.launch({
    executablePath, args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--disable-features=WebGPU'],
  });
  const context = await browser.newContext({ viewport: { width: 1280, height: 820 }, locale: 'en-GB', acceptDownloads: true });
  const page = await context.newPage();
  page.setDefaultTimeout(PATIENCE);
  page.on('console', message => {
    const found = message.text().match(/^typodont: (\S+) ?(.*)$/s);
    if (found && found[1] === 'screen' && found[2] !== state.screen) tell(`screen ${found[2]}`);
    if (found) state[found[1]] = found[2];
    else if (message.type() === 'error') complain(`logged: ${message.text()}`);
  });
  page.on('pageerror', error => complain(`thrown: ${error.stack || error.message}`));
  await page.goto(`http://127.0.0.1:${server.address().port}/platform.html`);
  const launch = await (await page.waitForSelector('#content')).contentFrame();
  await launch.waitForSelector('html[data-state="connected"]', { state: 'attached' });

  // The exercise that the package names opens at its instructions, in the learner's language, and nothing else can be chosen.
  await until('screen', screen => screen === 'briefing');
  const frame = await launch.waitForSelector('#exercise');
  const inner = await frame.contentFrame();
  claim(await inner.evaluate(() => document.documentElement.lang) === 'tr', 'the page is not in the language that the platform names');
  const click = async mark => {
    await until('marks', marks => marks.includes(`${mark}=`));
    const at = state.marks.match(new RegExp(`${mark.replace('.', '\\.')}=(\\d+),(\\d+)`));
    // The frame moves when the launch page says something.
    const { x, y } = await frame.boundingBox();
    await page.mouse.click(x + Number(at[1]), y + Number(at[2]));
  };
  await click('briefing.begin');
  await until('screen', screen => screen === 'practice');
  await page.keyboard.press('o');
  await until('pointer', pointer => pointer === 'held');
  await page.mouse.move(640, 420, { steps: 8 });
  await page.mouse.move(600, 440, { steps: 8 });
  await page.keyboard.press('Escape');
  await until('pointer', pointer => pointer === 'free');
  while (state.screen === 'practice') {
    await page.keyboard.press('Control+Enter');
    await until('asked', asked => asked === 'finish');
    await page.keyboard.press('Enter');
    await page.waitForTimeout(1000);
  }
  // Whoever has done the only exercise of a course is asked its questionnaire. It is handed in without ratings, which is confirmed.
  while (state.screen === 'questionnaire') {
    await page.keyboard.press('Control+Enter');
    await page.waitForTimeout(500);
  }
  await until('screen', screen => screen === 'results');
  await launch.waitForSelector('html[data-state="delivered"], html[data-state="failed"]', { state: 'attached' });
  claim(await launch.evaluate(() => document.documentElement.dataset.state) === 'delivered', 'the result is not delivered');

  const waiting = page.waitForEvent('download');
  await click('results.download');
  await (await waiting).saveAs(zip);
  const digest = crypto.createHash('sha256').update(fs.readFileSync(zip)).digest('hex');
  const kept = await page.evaluate(() => { const { cmi } = window.API; return [cmi.core.lesson_status, Number(cmi.core.score.raw), cmi.comments, cmi.suspend_data]; });
  claim(kept[0] === 'failed', `the platform has the status ${kept[0]}`);
  claim(kept[1] >= 0 && kept[1] < 100, `the platform has ${kept[1]} points`);
  claim(kept[2].includes(digest), `the platform has another digest than ${digest}: ${kept[2]}`);
  claim(kept[3].includes('5-grinding'), `the platform keeps ${kept[3]}`);
  await browser.close();
  server.close();
  process.exit(wrong.length ? 1 : 0);
})().catch(error => { console.error(error.stack || error); process.exit(1); });
