// Verifies results in the page, as an examiner does: chosen in the browser and dropped onto the page, by turns.
//
//     node verify_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES webgl|webgpu ANSWER=FILE…
//
// ANSWER is the word that the page's state log must say about FILE. Prints the seconds of each as JSON. Exits with 1 and a line per
// claim that does not hold.

const fs = require('fs');
const path = require('path');
const { claim, main, open } = require('./served_page.js');

const [playwright, executablePath, folder, pictures, adapter, ...files] = process.argv.slice(2);

main(async () => {
  const { page, address, state, until, click, close } = await open({ playwright, executablePath, folder, adapter });
  // Listened to from the start: a browser that is told only when the button is pressed may open a dialog of its own.
  let offer = () => {};
  page.on('filechooser', chooser => offer(chooser));
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await page.mouse.move(640, 400);
  // The first frames are laid out anew once the fonts are there.
  await until('frames', frames => Number(frames) > 10);
  const choose = async file => {
    const offered = new Promise((resolve, reject) => {
      offer = resolve;
      setTimeout(() => reject(new Error('the browser offers no files')), 30000);
    });
    await click('verify.choose');
    await (await offered).setFiles(file);
  };
  const drop = async file => {
    const given = { name: path.basename(file), content: fs.readFileSync(file).toString('base64') };
    const dragged = await page.evaluateHandle(({ name, content }) => {
      const transfer = new DataTransfer();
      transfer.items.add(new File([Uint8Array.from(atob(content), letter => letter.charCodeAt(0))], name, { type: 'application/zip' }));
      return transfer;
    }, given);
    await page.dispatchEvent('canvas', 'drop', { dataTransfer: dragged });
  };
  const seconds = {};
  for (const [index, named] of files.entries()) {
    const [wanted, file] = named.split('=');
    delete state.verification;
    const began = Date.now();
    await (index % 2 ? drop : choose)(file);
    const answer = await until('verification', answer => answer !== 'pending');
    const name = path.basename(file, '.zip');
    claim(answer === wanted, `${name} is ${answer}, not ${wanted}`);
    seconds[name] = (Date.now() - began) / 1000;
    await page.waitForTimeout(500);
    await page.screenshot({ path: path.join(pictures, `verified-${adapter}-${name}.png`) });
    // Every third is verified after the one before, without a way through the list.
    if (index % 3 !== 2) {
      await page.keyboard.press('Escape');
      // The button is at another place there.
      await until('marks', marks => marks.includes('shelf.open='));
    }
  }
  await close();
  console.log(JSON.stringify({ adapter, seconds }));
});
