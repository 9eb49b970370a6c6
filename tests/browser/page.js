// Goes through a lesson in the page as a trainee does, with a real mouse, from the shelf to a downloaded bundle.
//
//     node page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES BUNDLE.zip webgl|webgpu EXERCISE
//
// Serves the folder PAGE itself. `seed N` is printed once the exercise has begun, and what is to be done is read from the input as JSON:
// `goal`, a place in mm, is worked at until caries is removed; of each of `trials` the `place` is touched, and its `answers` are given
// as `QUESTION:ANSWER`; with neither the instrument is moved and pressed in every stage. Prints what was measured as JSON. Exits with 1 and a line per claim that does not hold.

const path = require('path');
const readline = require('readline');
const { PATIENCE, claim, finishLesson, main, open, openExercise, saveBundle } = require('./served_page.js');

const [playwright, executablePath, folder, pictures, zip, adapter, exercise] = process.argv.slice(2);

const numbers = text => text.split(' ').map(Number);

/** A vector of the world as one sees it in the picture: right, up, toward the eye. */
const inView = ([x, y, z], view) => {
  const [azimuth, elevation] = numbers(view);
  const [c, s] = [Math.cos(azimuth), Math.sin(azimuth)];
  [x, z] = [c * x - s * z, s * x + c * z];
  const [d, t] = [Math.cos(elevation), Math.sin(elevation)];
  return [x, d * y - t * z, t * y + d * z];
};

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter });
  const { page, context, address, state, until, close } = opened;
  const picture = name => page.screenshot({ path: path.join(pictures, `page-${adapter}-${exercise}-${name}.png`) });

  const began = Date.now();
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  const shown_ms = Date.now() - began;
  await page.mouse.move(640, 400);
  await picture('1-shelf');
  claim((await page.$('#status')) === null, 'the status is removed once the program draws');
  let making;
  await openExercise(opened, exercise, async () => {
    await picture('2-briefing');
    making = Date.now();
  });
  const made_ms = Date.now() - making;
  await picture('3-task');

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
      const [right, up] = inView(place.map((goal, i) => goal - hand[i]), state.view);
      if (Math.hypot(right, up) < 0.4) return;
      if (Date.now() > end) throw new Error(`the hand stays at ${hand}, away from ${place}`);
      const pixels = mm => Math.max(-120, Math.min(120, Math.round(8 * mm)));
      await move(pixels(right), pixels(-up));
    }
  };
  /** Ticks and frames since an earlier moment, per second. */
  const paceSince = ([at, ticks, frames]) => {
    const seconds = (Date.now() - at) / 1000;
    return { ticks_per_s: (Number(state.ticks) - ticks) / seconds, frames_per_s: (Number(state.frames) - frames) / seconds };
  };
  const now = () => [Date.now(), Number(state.ticks), Number(state.frames)];

  console.log(`seed ${state.seed}`);
  const work = JSON.parse(await new Promise(done => readline.createInterface({ input: process.stdin }).once('line', done)));
  // An open input would keep this process after its last line.
  process.stdin.destroy();
  const grind = async goal => {
    await pointAt(goal);
    const cutting = now();
    for (let round = 0; round < 40 && Number(state.cleared) < 10; round += 1) {
      const angle = 0.8 * round;
      await pointAt([goal[0] + 0.6 * Math.cos(angle), goal[1], goal[2] + 0.6 * Math.sin(angle)]);
      await page.mouse.down();
      await page.waitForTimeout(1500);
      if (round === 1) await picture('4-cutting');
      await page.mouse.up();
    }
    claim(Number(state.cleared) >= 10, `${state.cleared} % of the caries is removed`);
    return paceSince(cutting);
  };
  const touch = async () => {
    const touching = now();
    for (let round = 0; round < 6; round += 1) {
      await move(20 * Math.cos(round), 20 * Math.sin(round));
      await page.mouse.down();
      await page.waitForTimeout(700);
      await page.mouse.up();
    }
    return paceSince(touching);
  };
  const search = async trials => {
    const searching = now();
    for (const [number, { place, answers }] of trials.entries()) {
      if (number > 0) {
        await page.keyboard.press('o');
        await until('pointer', pointer => pointer === 'held');
      }
      await pointAt(place);
      await page.mouse.down();
      await page.waitForTimeout(1500);
      await page.mouse.up();
      if (number === 0) await picture('4-touching');
      await page.keyboard.press('Escape');
      await until('pointer', pointer => pointer === 'free');
      const { stage } = state;
      for (const answer of answers) {
        await opened.click(`answer:${answer}`);
        await page.waitForTimeout(700);
      }
      if (number + 1 < trials.length) await until('stage', now => now !== stage);
      else await until('screen', screen => screen !== 'practice');
    }
    return paceSince(searching);
  };
  const pace = await (work.goal ? grind(work.goal) : work.trials.length > 0 ? search(work.trials) : touch());
  const late = state.late;
  await picture('5-worked');
  // After the last trial the lesson ends by itself, but for a questionnaire.
  if (work.trials?.length > 0) await page.waitForTimeout(1500);
  const isOver = state.screen !== 'practice' && state.screen !== 'questionnaire';
  const ended = (isOver ? undefined : await finishLesson(opened)) ?? Date.now();
  await until('screen', screen => screen === 'results');
  const scored_ms = Date.now() - ended;
  await until('bundle', () => true);
  const completed_ms = Date.now() - ended;
  await page.waitForTimeout(1000);
  await picture('6-results');
  await saveBundle(opened, zip);

  // The report opens from the page, with its own script.
  const opening = context.waitForEvent('page', { timeout: PATIENCE });
  await page.keyboard.press('r');
  const report = await opening;
  await report.waitForFunction(() => document.documentElement.dataset.shown, null, { timeout: PATIENCE });
  await report.screenshot({ path: path.join(pictures, `page-${adapter}-${exercise}-7-report.png`) });
  await close();
  console.log(JSON.stringify({ adapter, exercise, shown_ms, made_ms, scored_ms, completed_ms, late, ...pace }));
});
