// Begins an exercise in the page and moves the instrument, to be compared with the installed program.
//
//     node beside_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURE.png webgl|webgpu EXERCISE SECONDS
//
// Saves the picture of the exercise before the instrument is taken, once it is as sharp as it gets, as PICTURE.png. Prints the seed
// and the ticks and frames per second while the instrument moves as JSON. Exits with 1 and a line per claim that does not hold.

const { main, open, openExercise } = require('./served_page.js');

const [playwright, executablePath, folder, picture, adapter, exercise, seconds] = process.argv.slice(2);

/** Time after which a still picture is as sharp as it gets, ms. */
const SHARP = 4000;

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter });
  const { page, address, state, until, close } = opened;
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await openExercise(opened, exercise, async () => {}, async () => {
    await page.mouse.move(2, 2);
    await page.waitForTimeout(SHARP);
    await page.screenshot({ path: picture });
    await page.mouse.move(640, 400);
  });
  const before = [Date.now(), Number(state.ticks), Number(state.frames)];
  for (let at = 0; Date.now() < before[0] + 1000 * Number(seconds); at += 1) {
    await page.mouse.move(640 + 60 * Math.cos(0.3 * at), 400 + 60 * Math.sin(0.3 * at));
    await page.waitForTimeout(20);
  }
  const took = (Date.now() - before[0]) / 1000;
  const [ticks, frames] = [Number(state.ticks) - before[1], Number(state.frames) - before[2]];
  const seed = state.seed;
  await close();
  console.log(JSON.stringify({ seed, ticks_per_s: ticks / took, frames_per_s: frames / took }));
});
