// Plays a package as a learning platform does, in Chromium: SCORM by the run-time of scorm-again around a frame, cmi5 by a launch.
//
//     node learning_platform.js PLAYWRIGHT-CORE CHROMIUM SCORM-AGAIN PACKAGE STANDARD SESSION [RECORD-STORE]
//
// PACKAGE is a folder with the archive's files, STANDARD one of 1.2, 2004 and cmi5, SESSION the session.json whose result the page
// announces. RECORD-STORE is the address of a learning record store, for cmi5. Exits with 1 and a line per claim that does not hold.

const fs = require('fs');
const http = require('http');
const path = require('path');

const [playwright, executablePath, scormAgain, folder, standard, sessionFile, recordStore] = process.argv.slice(2);
const { chromium } = require(playwright);
const session = JSON.parse(fs.readFileSync(sessionFile));
const grade = session.grade;
const percent = Math.round(10000 * grade.points / grade.max_points) / 100;
const LEARNER = 'student@school.example';
const CODE = 'student_40_school.example';
const ACTOR = { objectType: 'Agent', account: { homePage: 'https://school.example', name: LEARNER } };
const REGISTRATION = '2f1c8a52-6d0b-4c46-9ce1-7e0a3c1f5a10';
const ACTIVITY = 'https://school.example/unit/1';

const wrong = [];
const claim = (holds, what) => { if (!holds) wrong.push(what); };
const same = (seen, expected, what) => claim(JSON.stringify(seen) === JSON.stringify(expected), `${what}: ${JSON.stringify(seen)} instead of ${JSON.stringify(expected)}`);

/** The platform's page: its run-time, and the package in a frame. `options` change what the run-time gives and refuses. */
function platformPage(options) {
  const [script, kind, name] = standard === '1.2' ? ['scorm12.js', 'Scorm12API', 'API'] : ['scorm2004.js', 'Scorm2004API', 'API_1484_11'];
  const start = standard === '1.2'
    ? { cmi: { core: { student_id: LEARNER, lesson_mode: options.mode, lesson_status: 'not attempted' }, student_preference: { language: options.language } } }
    : { cmi: { learner_id: LEARNER, mode: options.mode, learner_preference: { language: options.language } } };
  if (options.kept) start.cmi.suspend_data = options.kept;
  return `<!DOCTYPE html><title>Platform</title><script src="/scorm-again/${script}"></script><script>
    const api = new ${kind}({ autocommit: false, logLevel: 5 });
    api.loadFromJSON(${JSON.stringify(start.cmi)}, 'cmi');
    const [begin, set] = ${JSON.stringify(standard === '1.2' ? ['LMSInitialize', 'LMSSetValue'] : ['Initialize', 'SetValue'])};
    window.values = {};
    const own = api[set].bind(api);
    api[set] = (element, value) => {
      if (${Boolean(options.refusesScore)} && /score.raw/.test(element)) return 'false';
      window.values[element] = value;
      const taken = own(element, value);
      if (String(taken) !== 'true') window.refused.push(element + ' = ' + value);
      return taken;
    };
    window.refused = [];
    if (${Boolean(options.refusesStart)}) api[begin] = () => 'false';
    if (${!options.isMissing}) window.${name} = api;
    window.runtime = api;
  </script><iframe id="content" src="/course/launch.html?exercise=0" style="width:100%;height:90vh"></iframe>`;
}

/** State documents and statements of a cmi5 launch; statements go on to a real record store. */
const documents = new Map();
const statements = [];
let tokens = 0;

async function cmi5(request, response, url, body) {
  if (url.pathname === '/fetch') {
    tokens += 1;
    return response.end(JSON.stringify(tokens > 1 ? { 'error-code': '1', 'error-text': 'The authorization token has already been returned.' }
      : { 'auth-token': Buffer.from('station:secret').toString('base64') }));
  }
  if (request.headers['x-experience-api-version'] === undefined || !/^Basic /.test(request.headers.authorization || '')) {
    response.statusCode = 401;
    return response.end();
  }
  if (url.pathname === '/xapi/statements') {
    const forwarded = await fetch(`${recordStore}/statements${url.search}`, {
      method: request.method, body,
      headers: { Authorization: request.headers.authorization, 'Content-Type': 'application/json', 'X-Experience-API-Version': '1.0.3' },
    });
    claim(forwarded.ok, `the record store refuses a statement: ${forwarded.status} ${await forwarded.text()} ${body}`);
    statements.push(JSON.parse(body));
    response.statusCode = 204;
    return response.end();
  }
  const key = `${url.pathname} ${url.searchParams.get('stateId') || url.searchParams.get('profileId')}`;
  if (request.method === 'PUT' && options.losesDocuments) {
    response.statusCode = 404;
    return response.end();
  }
  if (request.method === 'PUT') documents.set(key, body);
  response.statusCode = request.method === 'PUT' ? 204 : documents.has(key) ? 200 : 404;
  response.end(request.method === 'PUT' ? undefined : documents.get(key));
}

let options = {};
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.json': 'application/json', '.wasm': 'application/wasm' };
const server = http.createServer((request, response) => {
  const url = new URL(request.url, 'http://localhost');
  const parts = [];
  request.on('data', part => parts.push(part));
  request.on('end', () => {
    if (url.pathname === '/platform.html') {
      response.setHeader('Content-Type', 'text/html');
      return response.end(platformPage(options));
    }
    if (url.pathname === '/fetch' || url.pathname.startsWith('/xapi/')) {
      return cmi5(request, response, url, Buffer.concat(parts).toString()).catch(error => { wrong.push(`${error}`); response.end(); });
    }
    const [root, rest] = url.pathname.startsWith('/course/') ? [folder, url.pathname.slice(8)] : [scormAgain, url.pathname.replace('/scorm-again/', '')];
    const file = path.join(root, decodeURIComponent(rest));
    if (!fs.existsSync(file)) { response.statusCode = 404; return response.end(); }
    response.setHeader('Content-Type', TYPES[path.extname(file)] || 'application/octet-stream');
    response.end(fs.readFileSync(file));
  });
});

(async () => {
  await new Promise(done => server.listen(0, '127.0.0.1', done));
  const base = `http://127.0.0.1:${server.address().port}`;
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox'] });
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 }, locale: 'en-GB' });
  let page;

  const open = async (address, some) => {
    options = { mode: 'normal', language: '', ...some };
    page = await context.newPage();
    page.setDefaultTimeout(120000);
    page.on('pageerror', error => wrong.push(`thrown: ${error.message}`));
    await page.goto(base + address);
    const launch = address.startsWith('/platform') ? await (await page.waitForSelector('#content')).contentFrame() : page.mainFrame();
    await launch.waitForSelector('html[data-state]:not([data-state="connecting"])', { state: 'attached' });
    return launch;
  };
  const state = launch => launch.evaluate(() => document.documentElement.dataset.state);
  const status = launch => launch.evaluate(() => document.getElementById('status').textContent);
  /** Lets the page announce its result, as it does at the end of a session, and waits for what the launch page says to it. */
  const finish = async launch => {
    const inner = await (await launch.waitForSelector('#exercise')).contentFrame();
    await inner.waitForSelector('#finish');
    const asked = await inner.evaluate(() => location.search);
    await inner.click('#finish');
    await launch.waitForSelector('html[data-state="delivered"], html[data-state="failed"], html[data-state="none"]', { state: 'attached' });
    return new URLSearchParams(asked);
  };
  const runtime = body => page.evaluate(`(() => { const cmi = window.runtime.cmi; return ${body}; })()`);
  const leave = async () => { await page.evaluate(() => document.getElementById('content').remove()); await page.waitForTimeout(200); };

  if (standard === 'cmi5') await playCmi5();
  else await playScorm();

  async function playScorm() {
    let launch = await open('/platform.html', {});
    const asked = await finish(launch);
    same(asked.get('participant'), CODE, 'the participant');
    claim(/^exercises\/.+\.json$/.test(asked.get('exercise')), `the exercise is asked for as ${asked.get('exercise')}`);
    same(await state(launch), 'delivered', 'the state after a result');
    await page.waitForTimeout(1100);
    const kept = await runtime('cmi.suspend_data');
    claim(kept.length <= (standard === '1.2' ? 4096 : 64000), `${kept.length} characters of suspend data`);
    await leave();
    if (standard === '1.2') {
      same(await runtime('cmi.core.lesson_status'), grade.passed ? 'passed' : 'failed', 'lesson_status');
      same(await runtime('[cmi.core.score.raw, cmi.core.score.min, cmi.core.score.max].map(Number)'), [percent, 0, 100], 'score');
      // A run-time of SCORM 1.2 does not give these elements back.
      const given = await page.evaluate(() => window.values);
      same(grade.items.map((_, n) => ['id', 'type', 'weighting', 'result'].map(name => given[`cmi.interactions.${n}.${name}`])),
        grade.items.map(item => [item.metric, 'numeric', `${round(item.max_points)}`, `${round(item.points)}`]), 'interactions');
      claim((await runtime('cmi.comments')).includes('f'.repeat(64)), 'the digest is not in the comments');
    } else {
      same(await runtime('[cmi.success_status, cmi.completion_status]'), [grade.passed ? 'passed' : 'failed', 'completed'], 'status');
      same(await runtime('[cmi.score.raw, cmi.score.scaled].map(Number)'), [percent, Math.round(percent * 100) / 10000], 'score');
      same(await runtime('cmi.interactions.childArray.map(i => [i.id, i.type, Number(i.weighting), Number(i.result), i.description])'),
        grade.items.map(item => [item.metric, 'numeric', round(item.max_points), round(item.points), item.title]), 'interactions');
      claim((await runtime('cmi.comments_from_learner.childArray[0].comment')).includes('f'.repeat(64)), 'the digest is not in the comments');
    }
    const values = await page.evaluate(() => window.values);
    const time = values[standard === '1.2' ? 'cmi.core.session_time' : 'cmi.session_time'];
    claim((standard === '1.2' ? /^\d{4}:\d\d:0[1-9]\.\d\d$/ : /^PT[1-9]\.?\d*S$/).test(time), `session time ${time}`);
    same(await page.evaluate(() => window.refused), [], 'elements that the run-time refuses');
    claim(await page.evaluate(() => window.runtime.isTerminated()), 'the connection stays open after the page was left');

    // A review shows what was kept, and nothing to work on.
    launch = await open('/platform.html', { mode: 'review', kept });
    same(await launch.locator('#exercise').isVisible(), false, 'an exercise in a review');
    const review = await launch.locator('#review').innerText();
    claim(review.includes(`${percent} %`) && review.includes('f'.repeat(64)), `the review says ${review}`);
    for (const item of grade.items) claim(review.includes(item.title), `the review lacks ${item.title}`);
    // A resumed attempt opens the exercise again.
    launch = await open('/platform.html', { kept });
    same(await launch.locator('#exercise').isVisible(), true, 'the exercise of a resumed attempt');
    // Browsing, and platforms that are missing or broken: the exercise works, and one sentence says what is not delivered.
    launch = await open('/platform.html', { mode: 'browse' });
    same(await state(launch), 'browse', 'the state while browsing');
    for (const [some, first] of [[{ isMissing: true }, 'none'], [{ refusesStart: true }, 'refused']]) {
      launch = await open('/platform.html', some);
      same(await state(launch), first, 'the state at the start');
      await finish(launch);
      claim(/no grade is delivered/i.test(await status(launch)), `a broken platform: ${await status(launch)}`);
    }
    launch = await open('/platform.html', { refusesScore: true });
    await finish(launch);
    same(await state(launch), 'failed', 'the state after a refused score');
    claim(/No grade was delivered: .*score\.raw.*session\.zip/.test(await status(launch)), `a refused score: ${await status(launch)}`);
    // The learner's language, where the platform names one.
    const turkish = await browser.newContext({ locale: 'tr-TR' });
    page = await turkish.newPage();
    page.setDefaultTimeout(120000);
    options = { mode: 'normal', language: '', isMissing: true };
    await page.goto(`${base}/platform.html`);
    launch = await (await page.waitForSelector('#content')).contentFrame();
    await launch.waitForSelector('html[data-state="none"]', { state: 'attached' });
    claim(/Öğrenme|öğrenme/.test(await status(launch)), `in Turkish: ${await status(launch)}`);
    // A window from elsewhere cannot announce a result.
    await page.evaluate(() => document.getElementById('content').contentWindow.postMessage({ typodont: 1, event: 'result', session: {}, zip: {} }, '*'));
    await page.waitForTimeout(200);
    same(await state(launch), 'none', 'the state after a message of a stranger');
  }

  async function playCmi5() {
    const template = { contextActivities: { grouping: [{ id: ACTIVITY }] }, extensions: { 'https://w3id.org/xapi/cmi5/context/extensions/sessionid': 'one' } };
    const launchMode = mode => documents.set('/xapi/activities/state LMS.LaunchData', JSON.stringify({ contextTemplate: template, launchMode: mode, moveOn: 'Passed' }));
    documents.set('/xapi/agents/profile cmi5LearnerPreferences', JSON.stringify({ languagePreference: 'tr-TR,en' }));
    const query = new URLSearchParams({ endpoint: `${base}/xapi/`, fetch: `${base}/fetch`, actor: JSON.stringify(ACTOR), registration: REGISTRATION, activityId: ACTIVITY });
    const address = `/course/launch.html?exercise=0&${query}`;
    launchMode('Normal');
    let launch = await open(address, {});
    same(await launch.evaluate(() => document.documentElement.lang), 'tr', 'the language that the learner prefers');
    same((await finish(launch)).get('participant'), CODE, 'the participant');
    same(await state(launch), 'delivered', 'the state after a result');
    const verbsAfterLeaving = async () => {
      await page.goto('about:blank');
      for (let i = 0; i < 50 && !statements.some(s => /terminated$/.test(s.verb.id)); i++) await new Promise(done => setTimeout(done, 100));
      return statements.map(s => s.verb.id.split('/').pop());
    };
    same(await verbsAfterLeaving(), ['initialized', grade.passed ? 'passed' : 'failed', 'completed', 'terminated'], 'the statements');
    for (const statement of statements) {
      same([statement.actor, statement.object.id, statement.context.registration], [ACTOR, ACTIVITY, REGISTRATION], 'who, what and where of a statement');
      claim(statement.context.contextActivities.category.some(c => c.id.endsWith('categories/cmi5')), 'a statement lacks the category cmi5');
      same(statement.context.contextActivities.grouping, template.contextActivities.grouping, 'the template of the context');
    }
    const judged = statements[1].result;
    same([judged.score.raw, judged.score.scaled, judged.success], [percent, Math.round(percent * 100) / 10000, grade.passed], 'the score');
    claim(Object.values(judged.extensions).includes('f'.repeat(64)), 'the digest is not in the statement');
    // The token is given once: a second launch with it is refused, and the exercise works all the same.
    launch = await open(address, {});
    same(await state(launch), 'refused', 'the state after a used token');
    /** Opens the exercise again in the same registration, with a new token. */
    const again = async (mode, some) => {
      tokens = 0;
      statements.length = 0;
      launchMode(mode);
      return open(address, some);
    };
    launch = await again('Review', {});
    claim((await launch.locator('#review').innerText()).includes(`${percent} %`), 'the review lacks the result');
    same(await verbsAfterLeaving(), ['initialized', 'terminated'], 'the statements of a review');
    // "Passed" and "completed" may be stated once in a registration, however many sessions it has.
    launch = await again('Normal', {});
    await finish(launch);
    same(await verbsAfterLeaving(), ['initialized', ...grade.passed ? [] : ['failed'], 'terminated'], 'the statements of a second session');
    // A platform that loses what it is given has not received the result.
    launch = await again('Normal', { losesDocuments: true });
    await finish(launch);
    same(await state(launch), 'failed', 'the state after a document that is not kept');
  }

  await browser.close();
  server.close();
  server.closeAllConnections();
  wrong.forEach(line => console.error(line));
  process.exit(wrong.length ? 1 : 0);
})().catch(error => { console.error(wrong.join('\n'), error); process.exit(1); });

function round(value) { return Math.round(value * 100) / 100; }
