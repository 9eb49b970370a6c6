// Does an exercise of the page with a HID device.
//
//     node device_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES BUNDLE.zip open-handle|spacemouse|polhem
//
// The browser passes on only devices that are plugged in, so that the page and its worker are given another `navigator.hid`, with a
// device that speaks the real protocol (fake_hid.js). Prints what was measured as JSON. Exits with 1 and a line per claim that does not
// hold.

const fs = require('fs');
const path = require('path');
const { claim, finishLesson, main, open, openExercise, saveBundle } = require('./served_page.js');

const [playwright, executablePath, folder, pictures, zip, kind] = process.argv.slice(2);

const NAMES = { 'open-handle': 'Typodont Handle', spacemouse: 'SpaceMouse Compact', polhem: 'Teensyduino RawHID' };
const numbers = text => text.split(' ').map(Number);
const distance = (a, b) => Math.hypot(...a.map((mm, axis) => mm - b[axis]));

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const { page, context, address, state, until, placeOf, click, close } = opened;
  await context.route('**/worker.js', async route => {
    const response = await route.fetch();
    const fake = fs.readFileSync(path.join(__dirname, 'fake_hid.js'), 'utf8');
    await route.fulfill({ response, body: `globalThis.TYPODONT_FAKE = ${JSON.stringify(kind)};\n${fake}\n${await response.text()}` });
  });
  await page.addInitScript(name => {
    try { localStorage.setItem('typodont.settings', '{ "introduction_first": false, "hand_follows_view": false }'); } catch { /* blocked */ }
    const channel = new BroadcastChannel('hand');
    channel.onmessage = ({ data }) => { if (data.told) globalThis.told = data.told; };
    globalThis.tellHand = order => channel.postMessage(order);
    Object.defineProperty(navigator, 'hid', { value: {
      getDevices: async () => [],
      addEventListener: () => {},
      requestDevice: async ({ filters }) => {
        globalThis.asked = { filters, isActive: navigator.userActivation.isActive };
        return [{ productName: name }];
      },
    } });
  }, NAMES[kind]);
  const order = what => page.evaluate(what => globalThis.tellHand(what), what);
  const told = () => page.evaluate(() => globalThis.told);
  const untilTold = async (what, condition) => {
    const end = Date.now() + 60000;
    for (let now; !(now = await told()) || !condition(now); await page.waitForTimeout(20)) {
      if (Date.now() > end) throw new Error(`${what}: ${JSON.stringify(now)} ${JSON.stringify(state)}`);
    }
    return told();
  };
  const picture = name => page.screenshot({ path: path.join(pictures, `${kind}-${name}.png`) });

  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await click('menu.settings');
  await until('over', over => over === 'settings');
  // The window is in its place some frames later.
  await page.waitForTimeout(1000);
  // Where drawing is slow, a click may come within one frame and close the list that it has opened: then it is opened again.
  const clickUntil = async (mark, isDone) => {
    for (const end = Date.now() + 60000; !await isDone(); await page.waitForTimeout(1000)) {
      if (Date.now() > end) throw new Error(`${mark} has no effect: ${JSON.stringify(state)}`);
      await page.mouse.click(...await placeOf(mark), { delay: 300 });
    }
  };
  const isShown = mark => state.marks.split(' ').some(shown => shown.startsWith(`${mark}=`));
  await clickUntil('settings.device', () => isShown(`settings.device.${kind}`));
  await clickUntil(`settings.device.${kind}`, () => isShown('settings.allow_device'));
  await clickUntil('settings.allow_device', () => page.evaluate(() => Boolean(globalThis.asked)));
  const asked = await page.evaluate(() => globalThis.asked);
  claim(asked.isActive && asked.filters.length > 0, `the browser is asked ${JSON.stringify(asked)}`);
  await page.waitForTimeout(500);
  await picture('settings');
  await page.keyboard.press('Escape');

  const begin = async () => {
    await until('screen', screen => screen === 'practice');
    await until('hand', () => true);
    await until('clock', clock => clock === 'stopped');
  };
  await openExercise({ ...opened, begin }, '5-grinding');
  const opening = await told();
  claim(opening.opened === 1, `the device was opened ${opening.opened} times`);
  const measured = { kind };

  if (kind === 'open-handle') {
    const first = numbers(state.hand);
    claim(distance(first, [0, 20, 0]) < 0.2, `the hand begins at ${first}`);
    await order({ goal: [0, 14, 0] });
    await until('clock', clock => clock === 'running');
    await untilTold('the hand does not follow', ({ position }) => Math.abs(position[1] - 14) < 0.5);
    // Down onto the tooth, to which the bur holds the hand back.
    let goal = 14;
    while ((await told()).force[1] < 0.2) {
      goal -= 0.5;
      if (goal < -30) throw new Error(`no tooth is felt: ${JSON.stringify(await told())} ${JSON.stringify(state)}`);
      await order({ goal: [0, goal, 0] });
      await page.waitForTimeout(100);
    }
    await page.waitForTimeout(1000);
    const speeds = [];
    const heights = [];
    for (const end = Date.now() + 4000; Date.now() < end; await page.waitForTimeout(20)) {
      const now = await told();
      speeds.push(now.speed);
      heights.push(now.position[1]);
    }
    Object.assign(measured, await told(), {
      rms: Math.sqrt(speeds.reduce((sum, speed) => sum + speed * speed, 0) / speeds.length),
      swing: Math.max(...heights) - Math.min(...heights),
    });
    await picture('contact');
    claim(measured.wrong === 0, `${measured.wrong} reports break the protocol`);
    claim(measured.most <= 5 / 8 + 0.01, `up to ${measured.most} N`);
    // Unplugged, the lesson waits; plugged in again, it goes on.
    await order({ unplug: true });
    await until('standstill', why => why !== '');
    measured.standstill = state.standstill;
    await picture('unplugged');
    await order({ goal: [0, 14, 0], plug: true });
    await until('standstill', why => why === '');
    await untilTold('the hand does not follow', ({ position }) => Math.abs(position[1] - 14) < 0.5);
    await order({ goal: [0, goal, 0] });
    const again = await untilTold('no tooth is felt again', ({ force }) => force[1] > 0.03);
    claim(again.opened === 2, `the device was opened ${again.opened} times`);
  } else {
    const before = numbers(state.hand);
    await order({ deflection: kind === 'spacemouse' ? [300, 0, 0, 0, 0, 0] : [0, 200, 0, 0, 0, 0] });
    await until('clock', clock => clock === 'running');
    await until('hand', hand => distance(numbers(hand), before) > 3);
    await order({ deflection: [0, 0, 0, 0, 0, 0] });
    await page.waitForTimeout(2000);
    Object.assign(measured, await told());
    await picture('moved');
    claim(measured.wrong === 0, `${measured.wrong} reports break the protocol`);
    claim(measured.current === 0, `a current of ${measured.current} mA`);
    claim(kind !== 'spacemouse' || measured.lit, 'the light is off');
  }
  await finishLesson(opened);
  await saveBundle(opened, zip);
  await close();
  console.log(JSON.stringify(measured));
});
