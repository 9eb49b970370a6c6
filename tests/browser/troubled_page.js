// Works in the page while something fails around it: the browser keeps nothing, or has no room; the graphics processor stops; a second
// page is opened beside the first.
//
//     node troubled_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES webgl|webgpu TROUBLE EXERCISES
//
// TROUBLE is `blocked`, `full`, `stopped` or `second`. EXERCISES is a folder with 5-grinding.json. Saves the bundle of the session as
// PICTURES/TROUBLE.zip. Exits with 1 and a line per claim that does not hold.

const path = require('path');
const {
  LOST_MAX, beginLesson, claim, finishLesson, main, moveAbout, open, openExercise, saveBundle, sessionOf,
} = require('./served_page.js');

const [playwright, executablePath, folder, pictures, adapter, trouble, exercises] = process.argv.slice(2);
const zip = path.join(pictures, `${trouble}.zip`);
const GRINDING = '5-grinding';

const TROUBLES = {
  /** A browser that keeps nothing says so once, and the session is worked and saved as ever. */
  blocked: async opened => {
    const { page, address, until } = opened;
    await page.goto(`${address}?state-log&exercise=exercises/${GRINDING}.json`);
    await until('screen', screen => screen === 'briefing');
    await page.mouse.move(640, 400);
    await beginLesson(opened);
    await moveAbout(page, 2500);
    await until('complaint', complaint => complaint.startsWith('unkept-recording'));
    await page.screenshot({ path: path.join(pictures, 'blocked.png') });
    await finishLesson(opened);
    await saveBundle(opened, zip);
  },

  /** Where the browser has no room, the same. */
  full: async opened => {
    const { page, context, address, until } = opened;
    const developer = await context.newCDPSession(page);
    await page.goto(`${address}?state-log`);
    await until('screen', screen => screen === 'shelf');
    await developer.send('Storage.overrideQuotaForOrigin', { origin: new URL(address).origin, quotaSize: 1000 });
    await openExercise(opened, GRINDING);
    await moveAbout(page, 2500);
    const complaint = await until('complaint', complaint => complaint.startsWith('unkept-recording'));
    claim(/quota/i.test(complaint), `the reason is not named: ${complaint}`);
    await page.screenshot({ path: path.join(pictures, 'full.png') });
    await finishLesson(opened);
    await saveBundle(opened, zip);
  },

  /** When the graphics processor stops, a sentence leads to the session that was kept. */
  stopped: async opened => {
    const { page, browser, address, state, until, click } = opened;
    await page.goto(`${address}?state-log`);
    await until('screen', screen => screen === 'shelf');
    await openExercise(opened, GRINDING);
    await moveAbout(page, 2500);
    const seen = Number(state.ticks);
    const developer = await browser.newBrowserCDPSession();
    await developer.send('Browser.crashGpuProcess').catch(() => {});
    await page.waitForSelector('#lost:not([hidden])', { timeout: 30000 });
    await page.screenshot({ path: path.join(pictures, `stopped-${adapter}.png`) });
    const told = await page.innerText('#lost');
    claim(/Reload the page/.test(told) && !/yeniden/.test(told), `the page says: ${told}`);
    Object.keys(state).forEach(topic => delete state[topic]);
    await page.click('#lost button:visible');
    await until('unfinished', count => count === '1');
    await page.mouse.move(640, 400);
    await click('shelf.finish');
    await saveBundle(opened, zip);
    const kept = sessionOf(zip).servo.ticks;
    claim(seen > 100 && seen - kept <= LOST_MAX, `${kept} of ${seen} ticks are kept`);
  },

  /** A second page does not offer the session that runs in the first one, until that is closed. */
  second: async opened => {
    const { page: first, address, state, until, click, newPage } = opened;
    await first.goto(`${address}?state-log`);
    await until('screen', screen => screen === 'shelf');
    await openExercise(opened, GRINDING);
    await moveAbout(first, 2500);
    const open = async () => {
      Object.keys(state).forEach(topic => delete state[topic]);
      opened.page = await newPage();
      await opened.page.goto(`${address}?state-log`);
      await until('screen', screen => screen === 'shelf');
      await opened.page.waitForTimeout(2000);
      return state.unfinished;
    };
    claim(await open() === '0', 'the running session is offered to a second page');
    await first.close({ runBeforeUnload: false });
    await opened.page.close({ runBeforeUnload: false });
    claim(await open() === '1', 'the session of the closed page is not offered');
    await opened.page.mouse.move(640, 400);
    await click('shelf.finish');
    await saveBundle(opened, zip);
  },
};

main(async () => {
  const isBlocked = trouble === 'blocked';
  // A graphics processor that stops, and a store that is blocked, are told in the log, too.
  const mayFail = trouble === 'stopped' ? /./ : isBlocked ? /denied|insecure|blocked|SecurityError/i : /^$/;
  const opened = await open({ playwright, executablePath, folder, adapter, exercises, isBlocked, mayFail });
  await TROUBLES[trouble](opened);
  await opened.close();
});
