// Writes an exercise in the page as a designer does who has installed nothing: new, a tooth, a decay by a click, tested, saved, left,
// opened again.
//
//     node author_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES EXERCISE.json
//
// Saves the exercise as EXERCISE.json. Exits with 1 and a line per claim that does not hold.

const fs = require('fs');
const path = require('path');
const { PATIENCE, claim, finishLesson, main, moveAbout, open } = require('./served_page.js');

const [playwright, executablePath, folder, pictures, file] = process.argv.slice(2);

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const { page, address, state, until, placeOf, click, close } = opened;
  let offer = () => {};
  page.on('filechooser', chooser => offer(chooser));
  const picture = name => page.screenshot({ path: path.join(pictures, `author-page-${name}.png`) });
  const write = async (mark, text) => {
    await click(mark);
    await page.waitForTimeout(300);
    await page.keyboard.press('Control+a');
    await page.keyboard.type(text, { delay: 20 });
    await page.keyboard.press('Tab');
    await page.waitForTimeout(300);
  };
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await page.mouse.move(640, 400);
  await until('frames', frames => Number(frames) > 10);
  await click('shelf.new');
  await until('screen', screen => screen === 'author');
  await until('teeth', teeth => Number(teeth) > 0);
  await until('checked', checked => checked === 'true');
  await picture('1-new');
  await write('/id', 'cheek-side');
  await click('part:Tooth');
  const teeth = state.teeth;
  await click('tooth:16');
  await until('teeth', now => now !== teeth);
  await click('part:Decay');
  const decay = state.decay;
  const [x, y] = await placeOf('view');
  await page.mouse.click(x + 30, y + 55);
  await until('decay', now => now !== decay && now.includes('offset_mm'));
  await until('checked', checked => checked === 'true');
  await page.waitForTimeout(500);
  await picture('2-decay');
  claim(state.complaints === '0', `${state.complaints} complaints`);

  // A page that is closed a second after the last change has lost nothing of it.
  await page.waitForTimeout(1500);
  claim(await page.evaluate(() => localStorage.getItem('typodont.draft.new').includes('cheek-side')), 'the draft is kept');

  await click('try');
  await until('screen', screen => screen === 'practice');
  await until('clock', clock => clock === 'stopped');
  await page.keyboard.press('o');
  await until('pointer', pointer => pointer === 'held');
  await moveAbout(page, 1000);
  await picture('3-test');
  await finishLesson(opened);
  await until('screen', screen => screen === 'results');
  await until('bundle', () => true);
  await page.waitForTimeout(500);
  await page.keyboard.press('Escape');
  await until('screen', screen => screen === 'author');

  const waiting = page.waitForEvent('download', { timeout: PATIENCE });
  await click('save');
  const download = await waiting;
  await download.saveAs(file);
  claim(download.suggestedFilename() === 'cheek-side.json', `the exercise is saved as ${download.suggestedFilename()}`);
  await until('unsaved', unsaved => unsaved === 'false');
  claim(await page.evaluate(() => localStorage.getItem('typodont.draft.new') === null), 'the draft of a saved exercise is deleted');
  const written = JSON.parse(fs.readFileSync(file));
  claim(written.scene.jaw.tooth.fdi === 16, `the tooth is ${written.scene.jaw.tooth.fdi}`);
  await click('leave');
  await until('screen', screen => screen === 'shelf');
  await until('chosen', chosen => chosen === 'cheek-side');
  await page.waitForTimeout(500);
  await picture('4-list');

  // A shipped exercise is copied, changed and saved: the list's entry is the copy, not the original.
  const edit = async () => {
    await click('shelf.edit');
    await until('screen', screen => screen === 'author');
    await until('teeth', teeth => Number(teeth) > 0);
  };
  const leave = async () => {
    await page.waitForTimeout(1500);
    await click('leave');
    await until('screen', screen => screen === 'shelf');
  };
  while (state.chosen !== '5-grinding') {
    const before = state.chosen;
    await page.keyboard.press('ArrowUp');
    await until('chosen', chosen => chosen !== before);
  }
  await edit();
  await write('/id', 'own-grinding');
  const saving = page.waitForEvent('download', { timeout: PATIENCE });
  await click('save');
  await saving;
  await leave();
  await until('chosen', chosen => chosen === 'own-grinding');
  await edit();
  await until('unsaved', unsaved => unsaved === 'false');
  await leave();
  claim(state.chosen === 'own-grinding', `the list shows ${state.chosen} instead of the copy`);

  // The saved file is opened on another day, changed and left, edited and left again: the change is offered after all of it.
  const openFile = async () => {
    Object.keys(state).forEach(topic => delete state[topic]);
    await page.reload();
    await until('screen', screen => screen === 'shelf');
    await page.mouse.move(640, 400);
    await until('frames', frames => Number(frames) > 10);
    const offered = new Promise(resolve => { offer = resolve; });
    await click('shelf.open_file');
    await (await offered).setFiles(file);
    await until('chosen', chosen => chosen === 'cheek-side');
  };
  await openFile();
  await edit();
  await until('unsaved', unsaved => unsaved === 'false');
  await write('/id', 'changed');
  await until('unsaved', unsaved => unsaved === 'true');
  await leave();
  await until('chosen', chosen => chosen === 'changed');
  await edit();
  await until('unsaved', unsaved => unsaved === 'true');
  await leave();
  await openFile();
  await edit();
  await until('told', told => told === 'author.brought_back');
  await until('unsaved', unsaved => unsaved === 'true');
  await picture('5-brought-back');
  await close();
});
