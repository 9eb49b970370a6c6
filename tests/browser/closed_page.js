// Closes the page in the middle of a lesson; the next page finishes the session as it is, or goes on with it, in turns.
//
//     node closed_page.js PLAYWRIGHT-CORE CHROMIUM PAGE BUNDLES MOMENTS
//
// Saves the bundle of each session as BUNDLES/N.zip. Prints what was lost, in ticks, as JSON. Exits with 1 and a line per claim that
// does not hold.

const path = require('path');
const { LOST_MAX, claim, finishLesson, main, moveAbout, open, openExercise, saveBundle, sessionOf, takeInstrument, tell } =
  require('./served_page.js');

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
    const goesOn = moment % 2 === 1;
    await click(goesOn ? 'shelf.resume' : 'shelf.finish');
    if (goesOn) {
      await takeInstrument(opened);
      await moveAbout(opened.page, 1500);
      await finishLesson(opened);
    }
    const file = path.join(bundles, `${moment}.zip`);
    await saveBundle(opened, file);
    const { servo, resumed } = sessionOf(file);
    claim((resumed ?? []).length === Number(goesOn), `continued ${JSON.stringify(resumed)}`);
    const kept = goesOn ? Math.round(1000 * resumed[0].session_s) : servo.ticks;
    claim(!goesOn || servo.ticks > kept + 500, `only ${servo.ticks - kept} ticks have run after the interruption`);
    lost.push(seen - kept);
    claim(seen - kept <= LOST_MAX, `${seen - kept} of ${seen} ticks are lost`);
    tell(`closed after ${seen} ticks, ${seen - kept} lost; ended after ${servo.ticks}`);
    await opened.page.waitForTimeout(500);
  }
  await close();
  console.log(JSON.stringify({ lost }));
});
