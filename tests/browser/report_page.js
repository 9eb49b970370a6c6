// Opens a bundle's report.html in Chromium as a reader would: from the disk, without a network, with mouse and keyboard.
//
//     node report_page.js PLAYWRIGHT-CORE CHROMIUM BUNDLE PICTURES explored|played|hostile
//
// explored  what the pictures, marks and sections of a report show is what its label maps say
// played    the hand that is played back is the recorded one; colours by deviation, paper, narrow windows, no WebGL. PICTURES
//           has poses.json: poses of the recording at some ticks, which the page must hold
// hostile   a page with hostile texts is loaded, moved, translated and printed, and does no harm
//
// Prints what it measured as JSON. Exits with 1 and a line per claim that does not hold.

const fs = require('fs');
const path = require('path');
const zlib = require('zlib');

const [playwright, executablePath, bundle, pictures, part] = process.argv.slice(2);
const [explored, played, hostile] = ['explored', 'played', 'hostile'].map(name => name === part);
const { chromium } = require(playwright);
const { appearance } = require('./page_checks.js');

const wrong = [];
const claim = (holds, what) => { if (!holds) wrong.push(what); };

/** A gzipped NRRD of the bundle: sizes, origin, spacing, and its samples. */
function nrrd(name) {
  const bytes = fs.readFileSync(path.join(bundle, name));
  const end = bytes.indexOf('\n\n');
  const header = bytes.subarray(0, end).toString('latin1');
  const field = key => header.match(new RegExp(`^${key}: (.*)$`, 'm'))[1];
  const raw = zlib.gunzipSync(bytes.subarray(end + 2));
  const samples = field('type') === 'float' ? new Float32Array(raw.buffer, raw.byteOffset, raw.length / 4) : raw;
  const numbers = text => text.match(/-?[\d.]+(e-?\d+)?/g).map(Number);
  const directions = numbers(field('space directions'));
  const volume = { sizes: numbers(field('sizes')), origin: numbers(field('space origin')), spacing: [0, 4, 8].map(i => directions[i]), samples };
  volume.at = ([i, j, k]) => samples[(k * volume.sizes[1] + j) * volume.sizes[0] + i];
  return volume;
}

const tissues = nrrd('initial.seg.nrrd'), verdicts = nrrd('performance.seg.nrrd'), times = nrrd('removal_time.nrrd');

/** When a voxel of the label maps fell, by removal_time.nrrd; NaN where it did not. */
function fell(voxel) {
  const cell = voxel.map((v, axis) => Math.round(v + (tissues.origin[axis] - times.origin[axis]) / times.spacing[axis]));
  return cell.every((v, axis) => v >= 0 && v < times.sizes[axis]) ? times.at(cell) : NaN;
}

(async () => {
  const args = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
  const browser = await chromium.launch({ executablePath, args });
  // Drawn in software: with a quarter of the pixels, the same claims take a third of the time.
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, deviceScaleFactor: 0.5, locale: 'en-GB' });
  const asked = [];
  await context.route(url => url.protocol !== 'file:', route => { asked.push(route.request().url()); route.abort(); });
  const page = await context.newPage();
  page.on('console', message => { if (message.type() === 'error') wrong.push(`logged: ${message.text()}`); });
  page.on('pageerror', error => wrong.push(`thrown: ${error.message}`));
  page.on('dialog', dialog => { wrong.push(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
  page.on('request', request => { if (!request.url().startsWith('file:') && !request.url().startsWith('data:')) asked.push(request.url()); });

  const file = path.resolve(bundle, 'report.html');
  const began = Date.now();
  await page.goto(`file://${file}`, { timeout: 120000 });
  await page.waitForFunction(() => document.documentElement.dataset.shown, null, { timeout: 60000 });
  const shown_ms = Date.now() - began;
  const settled = async change => {
    await change();
    await page.waitForFunction(() => document.documentElement.dataset.drawn, null, { timeout: 60000 });
  };
  const picture = id => page.evaluate(id => document.getElementById(id).toDataURL(), id);
  const told = () => page.evaluate(() => ({ ...document.getElementById('told').dataset, text: document.getElementById('told').textContent }));
  const moment = () => page.evaluate(() => Number(document.getElementById('moment').value));
  const slide = to => settled(() => page.evaluate(to => {
    const slider = document.getElementById('moment');
    slider.value = to * slider.max;
    slider.dispatchEvent(new Event('input'));
  }, to));
  const photograph = async name => { if (pictures) await page.screenshot({ path: path.join(pictures, name) }); };
  const bytes = fs.statSync(file).size;
  claim(bytes < 6e6, `the page has ${bytes} bytes`);
  await photograph('report-top.png');
  await page.evaluate(() => document.getElementById('explore').scrollIntoView());

  let shown = 0, clicked = 0, fallen = 0, compared = 0;

  const ids = ['solid', 'cut-0', 'cut-1', 'cut-2'];
  const moments = await page.evaluate(() => JSON.parse(document.getElementById('session').textContent).moments);
  const timed = moments.filter(m => m.at !== null);
  claim(timed.length > 0, 'no moment is marked on the curves');

  if (!played) {
    // The time slider changes every picture.
    const seen = {};
    for (const share of [0, 0.4, 1]) {
      await slide(share);
      for (const id of ids) (seen[id] ||= new Set()).add(await picture(id));
      await photograph(`report-at-${share}.png`);
    }
    for (const id of ids) claim(seen[id].size === 3, `${id} shows ${seen[id].size} pictures at three moments`);

    // A mark on the curves moves the time, the eye and what is told; by mouse and by keyboard.
    for (const { number, at } of timed) {
      const before = await picture('solid');
      const mark = page.locator(`#curves [data-mark="${number}"]`);
      if (number % 2) await settled(() => mark.locator('circle').click());
      else await settled(async () => { await mark.focus(); await page.keyboard.press('Enter'); });
      claim(Math.abs(await moment() - at) < 0.011, `mark ${number} moves the time to ${await moment()} s, not ${at} s`);
      claim(await picture('solid') !== before, `mark ${number} does not move the eye`);
      claim((await told()).text.includes(`Flag ${number}.`), `mark ${number} tells: ${(await told()).text}`);
      if (number === 1) await photograph('report-mark.png');
    }
  }

  if (explored) {
    // What a sentence shows is seen: its place lies in the picture, nothing of the tooth at that moment lies before it, and a ring
    // is drawn around it. Regression: the tooth was turned by a rule that did not ask what covers the place.
    const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    for (const { number, at, place } of moments) {
      await settled(() => page.locator(`.feedback .show[data-mark="${number}"]`).first().click());
      const view = JSON.parse(await page.evaluate(() => document.getElementById('solid').dataset.view));
      const { right, up, half, clips, ratio, middle } = view;
      const back = [right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2], right[0] * up[1] - right[1] * up[0]];
      const from = place.map((v, axis) => v - middle[axis]);
      const [x, y] = [dot(from, right) / (half * ratio), dot(from, up) / half];
      claim(Math.max(Math.abs(x), Math.abs(y)) < 0.8, `the place of mark ${number} lies at ${x}, ${y} of the picture`);
      let covered = 0;
      for (let mm = 0.5; mm < 30; mm += 0.03) {
        const point = place.map((v, axis) => v + mm * back[axis]);
        if (clips.some((clip, axis) => clip !== null && Math.sign(back[axis]) * (point[axis] - clip) > 1e-3)) continue;
        const cell = point.map((v, axis) => Math.round((v - tissues.origin[axis]) / tissues.spacing[axis]));
        if (!cell.every((v, axis) => v >= 0 && v < tissues.sizes[axis])) continue;
        if (tissues.at(cell) !== 0 && !(fell(cell) <= (at ?? Infinity) + 5e-4)) covered += 0.03;
      }
      // A voxel that is less than half full has a tissue and is not drawn: one of them may lie in the line of sight.
      claim(covered < 1.5 * Math.min(...tissues.spacing), `${covered.toFixed(2)} mm of the tooth cover the place of mark ${number}`);
      const black = await page.evaluate(([x, y, radius]) => {
        const canvas = document.getElementById('solid'), copy = document.createElement('canvas');
        [copy.width, copy.height] = [canvas.width, canvas.height];
        const context = copy.getContext('2d');
        context.drawImage(canvas, 0, 0);
        const middle = [(x + 1) / 2 * canvas.width, (1 - y) / 2 * canvas.height], pixels = radius * canvas.height / 2;
        const isBlack = (u, v) => {
          const [r, g, b, a] = context.getImageData(Math.floor(u), Math.floor(v), 1, 1).data;
          return r + g + b === 0 && a === 255;
        };
        return Array.from({ length: 36 }, (_, i) => 2 * Math.PI * i / 36)
          .filter(angle => [-1, 0, 1].some(off => isBlack(middle[0] + (pixels + off) * Math.cos(angle), middle[1] + (pixels + off) * Math.sin(angle)))).length;
      }, [x, y, 0.35 / half]);
      claim(black >= 24, `${black} of 36 parts of the ring around mark ${number} are seen`);
      shown++;
    }
    claim(shown > 3, `${shown} places were shown`);

    // A voxel that is clicked says what the bundle's label maps say.
    await slide(1);
    await page.locator('[data-side="work"]').click();
    for (const id of ids) {
      const box = await page.locator(`#${id}`).boundingBox();
      for (const [x, y] of [[0.5, 0.5], [0.42, 0.45], [0.55, 0.6], [0.3, 0.5], [0.62, 0.38], [0.5, 0.7]]) {
        const before = await told();
        await page.locator(`#${id}`).click({ position: { x: x * box.width, y: y * box.height } });
        const { voxel, tissue, verdict, seconds, text } = await told();
        if (text === before.text) continue;
        clicked++;
        const cell = voxel.split(' ').map(Number), time = fell(cell);
        claim(Number(tissue) === tissues.at(cell), `voxel ${voxel}: tissue ${tissue}, the label map has ${tissues.at(cell)}`);
        claim(Number(verdict) === verdicts.at(cell), `voxel ${voxel}: verdict ${verdict}, the map has ${verdicts.at(cell)}`);
        if (Number.isNaN(time)) claim(seconds === '', `voxel ${voxel}: fell at ${seconds}, the map says never`);
        else {
          fallen++;
          claim(Math.abs(Number(seconds) - time) < 5e-4, `voxel ${voxel}: fell at ${seconds}, the map says ${time}`);
          claim(text.includes(`(${time.toFixed(3)} s)`), `voxel ${voxel}: told is ${text}`);
        }
      }
    }
    claim(clicked >= 10 && fallen >= 3, `${clicked} voxels were told, ${fallen} of them fallen`);
  }

  // What a click tells is shown as text, too.
  if (hostile) {
    await settled(() => page.locator('.feedback .show').first().click());
    await slide(1);
    const box = await page.locator('#cut-0').boundingBox();
    await page.locator('#cut-0').click({ position: { x: 0.5 * box.width, y: 0.5 * box.height } });
    claim((await told()).text.length > 0, 'a click on a voxel tells nothing');
  }

  if (!played) {
    // All of it by keyboard: the tooth turns, the time moves.
    const before = await picture('solid');
    await settled(async () => { await page.locator('#solid').focus(); await page.keyboard.press('ArrowLeft'); await page.keyboard.press('+'); });
    claim(await picture('solid') !== before, 'arrow keys do not turn the tooth');
    await page.locator('#moment').focus();
    await settled(() => page.keyboard.press('Home'));
    claim(await moment() === 0, 'Home does not lead to the beginning');
    await settled(() => page.keyboard.press('End'));
    for (const number of [0, 1]) await page.locator(`[data-clip="${number}"]`).check();
    await settled(() => page.locator('[data-side="work"]').click());
    await photograph('report-clipped.png');
  }

  if (explored) {
    // An adapter that is lost and comes back shows the same picture. Regression: colours by verdict and hatching came back on.
    // A slow adapter draws fewer pixels, by the time it took: with that time held, every picture has all of them.
    await page.evaluate(() => { performance.now = () => 0; });
    for (const share of [0.9, 1]) await slide(share);
    for (const choice of ['tissue', 'verdict']) {
      await settled(() => page.locator(`[name="colours"][value="${choice}"]`).check());
      const shown = await picture('solid');
      await page.evaluate(() => { window.lost = document.getElementById('solid').getContext('webgl2').getExtension('WEBGL_lose_context'); });
      await page.evaluate(() => new Promise(done => {
        document.getElementById('solid').addEventListener('webglcontextlost', done, { once: true });
        window.lost.loseContext();
      }));
      await settled(() => page.evaluate(() => new Promise(done => {
        document.getElementById('solid').addEventListener('webglcontextrestored', done, { once: true });
        window.lost.restoreContext();
      })));
      claim(await picture('solid') === shown, `coloured by ${choice}, another picture comes back with the adapter`);
    }
  }

  // The hand is played back: at any tick the page holds the recorded pose, within 0.01 mm and 0.1°, and draws it.
  const recorded = played ? JSON.parse(fs.readFileSync(path.join(pictures, 'poses.json'))) : [];
  const heldPose = () => page.evaluate(() => JSON.parse(document.getElementById('held').dataset.pose || 'null'));
  const slideTo = seconds => settled(() => page.evaluate(seconds => {
    const slider = document.getElementById('moment'), { step } = slider;
    slider.step = 'any';
    slider.value = seconds;
    slider.dispatchEvent(new Event('input'));
    slider.step = step;
  }, seconds));
  const off = { mm: 0, degrees: 0 };
  for (const { tick, tool, position, orientation } of recorded) {
    await page.evaluate(() => { delete document.documentElement.dataset.shown; });
    await slideTo(tick / 1000);
    const pose = await heldPose();
    const along = Math.abs(pose.orientation.reduce((sum, v, part) => sum + v * orientation[part], 0));
    const sine = Math.sqrt(Math.max(1 - along * along, 0));
    off.mm = Math.max(off.mm, Math.hypot(...position.map((v, axis) => v - pose.position[axis])));
    off.degrees = Math.max(off.degrees, 2 * Math.atan2(sine, along) * 180 / Math.PI);
    claim(pose.tool === tool, `tick ${tick}: instrument ${pose.tool}, the recording has ${tool}`);
  }
  claim(!played || recorded.length >= 20, `${recorded.length} poses were compared`);
  claim(off.mm <= 0.0101 && off.degrees <= 0.1001, `a pose is off by ${off.mm} mm and ${off.degrees}°`);

  // By keyboard: play, pause, pace, and a stop at each flag with its sentences.
  const isPaused = () => page.evaluate(() => document.getElementById('play').getAttribute('aria-labelledby') === 'play-name');
  const paused = () => page.waitForFunction(() => document.getElementById('play').getAttribute('aria-labelledby') === 'play-name', null, { timeout: 60000 });
  const passes = seconds => page.waitForFunction(seconds => Number(document.getElementById('moment').value) > seconds, seconds, { timeout: 60000 });
  const press = async (id, key) => { await page.locator(`#${id}`).focus(); await page.keyboard.press(key); };
  const captions = () => page.evaluate(() => (document.getElementById('caption').hidden ? '' : document.getElementById('caption').innerText));
  if (played) {
    const first = Math.min(...timed.map(m => m.at)), flags = timed.filter(m => Math.abs(m.at - first) < 5e-4);
    await slideTo(first - 0.3);
    claim(await captions() === '', `between the flags it says: ${await captions()}`);
    await press('play', 'Space');
    await paused();
    claim(Math.abs((await heldPose()).seconds - first) < 1e-9, `it stopped at ${(await heldPose()).seconds} s, not at the flag at ${first} s`);
    for (const { number } of flags) {
      const sentence = await page.evaluate(number => document.querySelector(`.feedback .show[data-mark="${number}"]`).parentElement.firstElementChild.textContent, number);
      claim((await captions()).includes(sentence.trim()), `flag ${number} says: ${await captions()}, not: ${sentence}`);
    }
    await photograph('report-flag.png');
    // From a flag it goes on; without stops, past every flag.
    await press('stops', 'Space');
    await press('play', 'Space');
    await passes(first + 0.02);
    claim(await captions() === '', `while it plays it says: ${await captions()}`);
    await press('play', 'Space');
    claim(await isPaused(), 'a second press does not pause');
    const rested = await moment();
    await page.waitForTimeout(400);
    claim(await moment() === rested, 'a paused page moves on');
    await slideTo(first - 0.1);
    await press('play', 'Space');
    await passes(first + 0.02);
    await press('play', 'Space');
    await press('stops', 'Space');
    await press('pace', 'ArrowDown');
    claim(await page.evaluate(() => document.getElementById('pace').value) === '2', 'an arrow key does not choose the pace');

    // The instrument and its force are in the picture, and never on paper.
    await slideTo(first);
    await settled(() => page.locator('[data-side="occlusal"]').click());
    const paper = () => page.evaluate(() => {
      window.dispatchEvent(new Event('beforeprint'));
      return document.getElementById('solid-print').toDataURL();
    });
    const [drawn, printed] = [await picture('solid'), await paper()];
    claim(await page.locator('#force-arrow').isVisible(), 'the force is not shown');
    claim(/^[\d.]+ N$/.test(await page.evaluate(() => document.getElementById('force-text').textContent)), 'the force has no number');
    await settled(() => page.locator('#show-instrument').click());
    claim(await picture('solid') !== drawn, 'the instrument is not in the picture');
    claim(await paper() === printed, 'the instrument is on paper');
    await settled(() => page.locator('#show-instrument').click());
    await page.locator('#show-force').click();
    await page.waitForFunction(() => getComputedStyle(document.getElementById('force-arrow')).visibility === 'hidden');
    await page.locator('#show-force').click();
    await slide(1);
    claim(await heldPose() === null, 'the instrument is shown over the result');
  }

  // Whoever cannot see it is told names; nothing is a bare button.
  const unnamed = await page.evaluate(() => [...document.querySelectorAll('button, input, canvas, [role=button]')].filter(element => {
    if (element.closest('[hidden]')) return false;
    const by = (element.getAttribute('aria-labelledby') || '').split(' ').map(id => document.getElementById(id)?.textContent || '').join('');
    const labels = [...(element.labels || [])].map(label => label.textContent).join('');
    return !(by + labels + (element.getAttribute('aria-label') || '') + element.textContent).trim();
  }).map(element => element.outerHTML));
  claim(unnamed.length === 0, `without a name: ${unnamed.join(' ')}`);

  // The other language: nothing of the first is left to be seen but what an author wrote.
  const text = () => page.evaluate(() => document.querySelector('main').innerText);
  const english = await text();
  await page.locator('[data-language="tr"]').click();
  const turkish = await text();
  const isLeft = await page.evaluate(() => [...document.querySelectorAll('span[lang="en"]')].some(span => span.offsetParent !== null));
  claim(!isLeft && english !== turkish && turkish.includes('Puanlar nasıl verildi'), 'the page does not change its language');
  await page.evaluate(() => window.scrollTo(0, 0));
  await photograph('report-turkish.png');
  await page.locator('[data-language="en"]').click();

  if (played) {
    // The signed distance from the ideal cavity, by its definition: what was to be removed is the ideal cavity; of a place within
    // it the distance to the nearest tissue that should stay, of another the distance to the ideal cavity, each to the border
    // halfway between two voxels.
    const isIdeal = cell => [2, 5].includes(verdicts.at(cell));
    const deviation = cell => {
      const reach = 14, within = isIdeal(cell), own = Math.min(...tissues.spacing);
      let least = Infinity;
      for (let k = -reach; k <= reach; k++) for (let j = -reach; j <= reach; j++) for (let i = -reach; i <= reach; i++) {
        const other = [cell[0] + i, cell[1] + j, cell[2] + k];
        if (!other.every((v, axis) => v >= 0 && v < tissues.sizes[axis])) continue;
        if (within ? isIdeal(other) || tissues.at(other) === 0 : !isIdeal(other)) continue;
        least = Math.min(least, Math.hypot(i * tissues.spacing[0], j * tissues.spacing[1], k * tissues.spacing[2]));
      }
      return { mm: within ? 0.5 * own - least : least - 0.5 * own, isNear: least < reach * own };
    };
    // The whole tooth from the working side: the sections that clip it were moved by what was clicked.
    for (const number of [0, 1]) await page.locator(`[data-clip="${number}"]`).uncheck();
    await settled(() => page.locator('[data-side="work"]').click());
    await settled(() => page.locator('[name="colours"][value="deviation"]').check());
    await photograph('report-deviation.png');
    for (const id of ids) {
      const box = await page.locator(`#${id}`).boundingBox();
      for (const [x, y] of [[0.5, 0.5], [0.45, 0.55], [0.55, 0.45], [0.4, 0.5], [0.6, 0.55]]) {
        await page.locator(`#${id}`).click({ position: { x: x * box.width, y: y * box.height } });
        const shown = await told();
        if (!shown.deviation) continue;
        const expected = deviation(shown.voxel.split(' ').map(Number));
        if (!expected.isNear) continue;
        compared++;
        claim(Math.abs(Number(shown.deviation) - expected.mm) < 0.002, `voxel ${shown.voxel}: deviation ${shown.deviation}, by its definition ${expected.mm}`);
        claim(/beyond the ideal cavity|short of the ideal cavity/.test(shown.text), `voxel ${shown.voxel}: told is ${shown.text}`);
      }
    }
    claim(compared >= 5, `${compared} deviations were compared`);
  }

  // Walls that diverge by a known angle, and by none where they are round.
  const tapers = await page.evaluate(() => {
    const soft = half => ({ dims: [80, 80, 60], spacing: [0.1, 0.1, 0.1], sample: (x, y, z) => (z > 50 ? 0 : z < 10 ? 1 : Math.min(Math.max(0.5 + Math.abs(x - 40) - half(z), 0), 1)) });
    const walls = degrees => soft(z => 10 + (z - 10) * Math.tan(degrees / 2 * Math.PI / 180));
    const bowl = soft(z => Math.sqrt(Math.max(40 * 40 - (50 - z) ** 2, 0)) * 0.8);
    return [...[12, 0, -8].map(degrees => wallTaper(walls(degrees), 0, [40, 40, 30])), wallTaper(bowl, 0, [40, 40, 30])];
  });
  [12, 0, -8].forEach((degrees, n) => claim(Math.abs(tapers[n] - degrees) < 0.5, `walls of ${degrees}° are told as ${tapers[n]}°`));
  claim(tapers[3] === null, `a round cavity has walls of ${tapers[3]}°`);

  // Mesial is on the left of both sections that show it.
  const sides = await page.evaluate(() => ({ plain: SECTIONS, mirrored: MIRRORED_SECTIONS }));
  for (const [name, mesial] of [['plain', -1], ['mirrored', 1]]) {
    for (const section of [1, 2]) claim(sides[name][section][0][1] === -mesial, `${name} section ${section}: mesial is not on the left`);
  }

  let sheets = 0, summary = 0;
  if (!explored) {
    // On paper: the summary on one page, six pages at most, and the tooth in them.
    await settled(() => page.locator('[name="colours"][value="verdict"]').check());
    const pdf = await page.pdf({ format: 'A4', printBackground: true });
    if (pictures) fs.writeFileSync(path.join(pictures, 'report.pdf'), pdf);
    const source = pdf.toString('latin1');
    sheets = (source.match(/\/Type\s*\/Page\b(?!s)/g) || []).length;
    claim(sheets >= 2 && sheets <= 6, `${sheets} pages on paper`);
    const printed = await page.evaluate(() => ['solid-print', 'deviation-print'].map(id => {
      const canvas = document.getElementById(id), { width, height } = canvas;
      const pixels = new Uint32Array(canvas.getContext('2d').getImageData(0, 0, width, height).data.buffer);
      return { width, height, colours: new Set(pixels).size };
    }));
    for (const { width, height, colours } of printed) {
      const isIn = source.includes(`/Width ${width}`) && source.includes(`/Height ${height}`);
      claim(colours > 100 && isIn, `the tooth on paper: ${width} × ${height} pixels, ${colours} colours, ${isIn ? 'in' : 'not in'} the file`);
    }
    await page.emulateMedia({ media: 'print' });
    await page.setViewportSize({ width: Math.floor(184 / 25.4 * 96), height: 900 });
    summary = await page.evaluate(() => document.getElementById('explore').getBoundingClientRect().top + window.scrollY);
    // Titles of ninety letters without a space fill more than one sheet, and are broken.
    claim(hostile || summary <= 273 / 25.4 * 96, `the summary is ${Math.round(summary)} pixels high on paper`);
    const unwanted = await page.evaluate(() => [...document.querySelectorAll('.screen, .formula, .time, .player, .force')].filter(e => e.offsetParent !== null).map(e => e.textContent.trim().slice(0, 40)));
    claim(unwanted.length === 0, `printed: ${unwanted.join(' | ')}`);
    await page.emulateMedia({ media: null });
    wrong.push(...(await appearance(page)).filter(line => !hostile || !line.startsWith('a word is broken')));

    // A narrow window has nothing beside it.
    await page.setViewportSize({ width: 400, height: 800 });
    const beyond = await page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
    claim(beyond <= 0, `${beyond} pixels stand out of a window of 400`);

    // Without WebGL, and with still pictures for whoever prefers them: the hand is told, and time goes on in steps of a second.
    const plain = await browser.newContext({ viewport: { width: 1280, height: 1000 }, reducedMotion: 'reduce' });
    const bare = await plain.newPage();
    bare.on('pageerror', error => wrong.push(`thrown without WebGL: ${error.message}`));
    await bare.addInitScript(() => {
      const given = HTMLCanvasElement.prototype.getContext;
      HTMLCanvasElement.prototype.getContext = function (kind, ...more) { return kind === 'webgl2' ? null : given.call(this, kind, ...more); };
    });
    await bare.goto(`file://${file}`, { timeout: 120000 });
    await bare.waitForFunction(() => document.documentElement.dataset.shown, null, { timeout: 60000 });
    claim(!(await bare.locator('#solid').isVisible()), 'an empty picture is shown without WebGL');
    await bare.locator('#stops').uncheck({ force: true });
    await bare.evaluate(() => {
      window.times = [];
      new MutationObserver(() => window.times.push(document.getElementById('moment').value)).observe(document.getElementById('moment'), { attributeFilter: ['aria-valuetext'] });
    });
    await bare.locator('#play').click();
    await bare.waitForTimeout(2600);
    await bare.locator('#play').click();
    const steps = await bare.evaluate(() => [...new Set(window.times)]);
    claim(steps.length >= 2 && steps.length <= 4, `${steps.length} pictures in 2.6 s: ${steps.join(' ')}`);
    claim((await bare.locator('#held').textContent()).match(/\sN$/) || hostile, `told without WebGL: ${await bare.locator('#held').textContent()}`);
    await plain.close();
  }
  claim(asked.length === 0, `asked of a network: ${asked.join(' ')}`);
  await browser.close();
  console.log(JSON.stringify({ bytes, shown_ms, moments: moments.length, shown, clicked, fallen, compared, poses: recorded.length, off, sheets, summary_px: Math.round(summary) }));
  for (const line of wrong) console.error(line);
  process.exit(wrong.length ? 1 : 0);
})().catch(error => { console.error(error); process.exit(1); });
