// Closes the page in the middle of a lesson, and finishes the session in the next page.
//
//     node closed_page.js PLAYWRIGHT-CORE CHROMIUM PAGE BUNDLES MOMENTS
//
// Saves the bundle of each session as BUNDLES/N.zip. Prints what was lost, in ticks, as JSON. Exits with 1 and a line per claim that
// does not hold.

const path = require('path');
const { LOST_MAX, claim, main, moveAbout, open, openExercise, saveBundle, sessionOf, tell } = require('./served_page.js');

const [playwright, executablePath, folder, bundles, moments] = process.argv.slice(2);

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const { state, until, click, close, reopen } = opened;
  const lost = [];
  for (let moment = 0; moment < Number(moments); moment += 1) {
    await reopen('?state-log');
    await until('screen', screen => screen === 'shelf');
    await until('unfinished', count => count === '0');
    await openExercise(opened, '5-grinding');
    await moveAbout(opened.page, 1500 + 6000 * Math.random());
    const seen = Number(state.ticks);
    claim(seen > 100, `only ${seen} ticks have run`);

    // As the system ends a tab: without a question, and without a last word to the program.
    await reopen('?state-log');
    await until('unfinished', count => count === '1');
    await click('shelf.finish');
    const file = path.join(bundles, `${moment}.zip`);
    await saveBundle(opened, file);
    const kept = sessionOf(file).servo.ticks;
    lost.push(seen - kept);
    claim(seen - kept <= LOST_MAX, `${seen - kept} of ${seen} ticks are lost`);
    tell(`closed after ${seen} ticks, ${seen - kept} lost`);
    await opened.page.waitForTimeout(500);
  }
  await close();
  console.log(JSON.stringify({ lost }));
});
