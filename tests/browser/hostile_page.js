// Opens exercises that mean harm in the page, by its address.
//
//     node hostile_page.js PLAYWRIGHT-CORE CHROMIUM PAGE EXERCISES PICTURES ANSWER=FILE…
//
// ANSWER is `opened` or `refused`: what must become of FILE, a file of the folder EXERCISES or a whole address. Whatever is asked from
// another server, and every dialog, is complained of. Exits with 1 and a line per claim that does not hold.

const path = require('path');
const { claim, main, open, tell } = require('./served_page.js');

const [playwright, executablePath, folder, exercises, pictures, ...files] = process.argv.slice(2);

/** Longest time for which the page may not react while it says nothing of what it does, ms. */
const FREEZE_MAX = 1000;

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl', exercises, mayFail: /404|Failed to load resource/ });
  const { page, address, state, until } = opened;
  await page.addInitScript(() => {
    let last = performance.now();
    globalThis.longestFreeze = 0;
    setInterval(() => {
      const now = performance.now();
      const isTold = document.querySelector('#status:not(.failed):not(.no-exercise)');
      if (!isTold) globalThis.longestFreeze = Math.max(globalThis.longestFreeze, now - last);
      last = now;
    }, 50);
  });
  for (const named of files) {
    const [answer, ...rest] = named.split('=');
    const file = rest.join('=');
    Object.keys(state).forEach(topic => delete state[topic]);
    const exercise = /^[a-z]+:|^\/\//.test(file) ? file : `exercises/${file}`;
    await page.goto(`${address}?state-log&exercise=${encodeURIComponent(exercise)}`);
    // One that cannot be read is complained of in the page's status; one with mistakes is listed with them.
    const unread = page.waitForSelector('#status.no-exercise', { timeout: 60000 }).then(() => 'unread');
    const shown = until('screen', screen => /^(briefing|shelf)$/.test(screen)).then(screen => screen === 'briefing' ? 'opened' : 'listed');
    unread.catch(() => {});
    shown.catch(() => {});
    const became = await Promise.race([unread, shown]);
    claim(answer === 'opened' ? became === 'opened' : became !== 'opened', `${file} is ${became}, not ${answer}`);
    const chosen = became === 'listed' ? await until('chosen', () => true) : file;
    claim(chosen === file, `the list shows ${chosen} instead of ${file}`);
    if (became === 'unread') {
      const reason = await page.innerText('#reason');
      claim(reason.length > 10 && reason.length < 2000, `${file}: the reason is: ${reason.slice(0, 300)}`);
      tell(`${file}: ${reason.split('\n')[0].slice(0, 200)}`);
    } else {
      // The picture and the texts of the briefing or of the list.
      await page.waitForTimeout(1500);
    }
    const freeze = await page.evaluate(() => globalThis.longestFreeze);
    claim(freeze < FREEZE_MAX, `${file}: the page stands still for ${freeze} ms without a word`);
    await page.screenshot({ path: path.join(pictures, `hostile-${path.basename(file).slice(0, 40).replace(/\W/g, '-')}.png`) });
  }
  await opened.close();
});
