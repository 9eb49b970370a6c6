// Closes the page in the middle of a lesson, and finishes the session in the next page.
//
//     node closed_page.js PLAYWRIGHT-CORE CHROMIUM PAGE BUNDLES MOMENTS
//
// Saves the bundle of each session as BUNDLES/N.zip. Prints what was lost, in ticks, as JSON. Exits with 1 and a line per claim that
// does not hold.

const { execFileSync } = require('child_process');
const path = require('path');
const { claim, main, open, tell } = require('./served_page.js');

const [playwright, executablePath, folder, bundles, moments] = process.argv.slice(2);

/** Ticks that may be lost: a second. */
const LOST_MAX = 1000;

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const { state, until, click, close, reopen } = opened;
  const lost = [];
  for (let moment = 0; moment < Number(moments); moment += 1) {
    await reopen('?state-log');
    await until('screen', screen => screen === 'shelf');
    await until('unfinished', count => count === '0');
    await opened.page.mouse.move(640, 400);
    while (state.chosen !== '5-grinding') {
      const before = state.chosen;
      await opened.page.keyboard.press('ArrowDown');
      await until('chosen', chosen => chosen !== before);
    }
    await click('shelf.open');
    await until('screen', screen => screen === 'briefing');
    await click('briefing.begin');
    await until('screen', screen => screen === 'practice');
    await until('clock', clock => clock === 'stopped');
    await opened.page.keyboard.press('o');
    await until('pointer', pointer => pointer === 'held');
    const end = Date.now() + 1500 + 6000 * Math.random();
    for (let at = 0; Date.now() < end; at += 1) {
      await opened.page.mouse.move(640 + 60 * Math.cos(at), 400 + 60 * Math.sin(at), { steps: 3 });
      await opened.page.mouse.down();
      await opened.page.waitForTimeout(300);
      await opened.page.mouse.up();
    }
    const seen = Number(state.ticks);
    claim(seen > 100, `only ${seen} ticks have run`);

    // As the system ends a tab: without a question, and without a last word to the program.
    await reopen('?state-log');
    await until('unfinished', count => count === '1');
    await click('shelf.finish');
    await until('screen', screen => screen === 'results');
    await until('bundle', () => true);
    const waiting = opened.page.waitForEvent('download');
    await click('results.download');
    const file = path.join(bundles, `${moment}.zip`);
    await (await waiting).saveAs(file);
    const session = JSON.parse(execFileSync('unzip', ['-p', file, '*/session.json'], { maxBuffer: 1 << 26 }));
    const kept = session.servo.ticks;
    lost.push(seen - kept);
    claim(seen - kept <= LOST_MAX, `${seen - kept} of ${seen} ticks are lost`);
    tell(`closed after ${seen} ticks, ${seen - kept} lost`);
    await opened.page.waitForTimeout(500);
  }
  await close();
  console.log(JSON.stringify({ lost }));
});
