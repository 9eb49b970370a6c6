// Opens the page again where no server answers: a room without a network, after one visit with it.
//
//     node offline_page.js PLAYWRIGHT-CORE CHROMIUM PAGE
//
// Exits with 1 and a line per claim that does not hold.

const { claim, main, open } = require('./served_page.js');

const [playwright, executablePath, folder] = process.argv.slice(2);

main(async () => {
  const { page, address, server, state, until, click, close } = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await page.waitForFunction(() => navigator.serviceWorker.controller);
  const kept = await page.evaluate(async () => {
    const names = await caches.keys();
    const requests = await Promise.all(names.map(async name => (await caches.open(name)).keys()));
    return requests.flat().map(request => new URL(request.url).pathname);
  });
  claim(kept.some(name => name.endsWith('.wasm')), `the program is kept: ${kept}`);

  const status = await page.evaluate(async () => (await fetch('start.js')).status);
  claim(status === 200, `start.js is answered by ${status}`);
  const still = await page.evaluate(async () => (await caches.open((await caches.keys())[0])).keys().then(keys => keys.length));
  claim(still === kept.length, `${still} files are kept instead of ${kept.length}`);

  await new Promise(done => { server.close(done); server.closeAllConnections(); });
  for (const at of [`${address}?state-log`, `${address}index.html?state-log&language=tr`]) {
    delete state.screen;
    await page.goto(at);
    await until('screen', screen => screen === 'shelf');
  }
  await page.mouse.move(640, 400);
  await click('shelf.open');
  await until('screen', screen => screen === 'briefing');
  await close();
});
