// Works in an exercise of the page with a pen, with fingers and with a gamepad.
//
//     node hands_page.js PLAYWRIGHT-CORE CHROMIUM PAGE PICTURES BUNDLE.zip
//
// The pen and the fingers go through the browser's own input, a pen with its pressure and its tilt. The browser has no way to a gamepad without a real one:
// the page is given an object as `navigator.getGamepads` returns it. Prints what was measured as JSON. Exits with 1 and a line per claim
// that does not hold.

const path = require('path');
const { claim, finishLesson, main, open, openExercise, saveBundle } = require('./served_page.js');

const [playwright, executablePath, folder, pictures, zip] = process.argv.slice(2);

const numbers = text => text.split(' ').map(Number);

main(async () => {
  const opened = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const { page, context, address, state, until, close } = opened;
  await page.addInitScript(() => {
    globalThis.pad = undefined;
    const shown = (prototype, values) => Object.create(prototype, Object.fromEntries(Object.entries(values).map(([key, value]) => [key, { value }])));
    navigator.getGamepads = () => {
      if (!globalThis.pad) return [null];
      const { axes = [0, 0, 0, 0], left = 0, right = 0, pressed = [] } = globalThis.pad;
      const value = index => index === 6 ? left : index === 7 ? right : Number(pressed.includes(index));
      const buttons = Array.from({ length: 17 }, (_, index) => shown(GamepadButton.prototype, { value: value(index), pressed: value(index) > 0 }));
      return [shown(Gamepad.prototype, { connected: true, mapping: 'standard', axes, buttons })];
    };
  });
  const browser = await context.newCDPSession(page);
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await openExercise(opened, '5-grinding');
  const picture = name => page.screenshot({ path: path.join(pictures, `hands-${name}.png`) });

  /** The greatest force that the state log tells of in a time, N. */
  const greatestForce = async time => {
    let greatest = 0;
    for (const end = Date.now() + time; Date.now() < end;) {
      greatest = Math.max(greatest, Number(state.force));
      await page.waitForTimeout(20);
    }
    return greatest;
  };

  const [x, y] = [600, 420];
  const pen = (type, force, tiltX, tiltY) => browser.send('Input.dispatchMouseEvent', {
    type, x, y, force, tiltX, tiltY, pointerType: 'pen', button: type === 'mouseMoved' && force === 0 ? 'none' : 'left',
    buttons: force > 0 ? 1 : 0, clickCount: type === 'mouseMoved' ? 0 : 1,
  });
  await pen('mouseMoved', 0, 40, 0);
  await pen('mouseMoved', 0, 40, 0);
  const [azimuth] = numbers(state.view);
  // To the right as one sees the view.
  const right = ([hx, , hz]) => Math.cos(azimuth) * hx - Math.sin(azimuth) * hz;
  await until('handle', handle => right(numbers(handle)) > 0.55);
  const tilted = numbers(state.handle);
  await picture('pen');
  await pen('mousePressed', 0.3, 40, 0);
  const light = await greatestForce(2000);
  await pen('mouseMoved', 1, 40, 0);
  const hard = await greatestForce(3000);
  claim(light > 0.1 && light < 0.6 * hard, `a light pen presses with ${light} N, a hard one with ${hard} N`);
  await pen('mouseReleased', 0, 40, 0);
  await page.mouse.move(x + 3, y);
  await page.mouse.move(x, y);
  await until('handle', handle => numbers(handle)[1] > 0.98);

  // A browser tells of a force for fingers, too, of which nothing is measured.
  const touch = (type, touchPoints) => browser.send('Input.dispatchTouchEvent', { type, touchPoints });
  const fingers = [{ x, y, id: 1, force: 1 }, { x: x + 150, y: y + 60, id: 2, force: 1 }];
  // The pen leaves, as it does when a mouse is moved.
  await page.mouse.move(x + 3, y);
  await page.mouse.move(x, y);
  await touch('touchStart', fingers.slice(0, 1));
  // The tip drags while the handle returns from the pen's tilt.
  await until('handle', handle => numbers(handle)[1] > 0.98);
  await page.waitForTimeout(1000);
  const pointing = await greatestForce(2000);
  await picture('finger');
  await touch('touchStart', fingers);
  const pressing = await greatestForce(3000);
  await picture('fingers');
  await touch('touchEnd', []);
  claim(pointing < 0.3 * pressing && pressing > 0.2, `one finger presses with ${pointing} N, two with ${pressing} N`);
  await page.mouse.move(x + 3, y);
  await page.mouse.move(x, y);

  const hold = pad => page.evaluate(pad => { globalThis.pad = pad; }, pad);
  await hold({});
  const before = numbers(state.hand);
  await hold({ axes: [1, 0, 0, 0] });
  await until('hand', hand => Math.hypot(...numbers(hand).map((mm, i) => mm - before[i])) > 1);
  await hold({});
  await hold({ right: 0.9 });
  const pulled = await greatestForce(3000);
  claim(pulled > 0.2, `the trigger presses with ${pulled} N`);
  await hold({});
  const view = state.view;
  await hold({ axes: [0, 0, 1, 0] });
  await until('view', now => now !== view);
  await hold({});
  await hold({ left: 1 });
  await page.waitForTimeout(300);
  await hold({ left: 1, axes: [-1, 0, 0, 0] });
  await until('handle', handle => numbers(handle)[1] < 0.9);
  await hold({});
  await picture('gamepad');
  // A page that is not seen stands still.
  const hide = isHidden => page.evaluate(isHidden => {
    for (const [name, value] of [['hidden', isHidden], ['visibilityState', isHidden ? 'hidden' : 'visible']]) {
      Object.defineProperty(document, name, { configurable: true, get: () => value });
    }
    document.dispatchEvent(new Event('visibilitychange'));
  }, isHidden);
  await hide(true);
  await page.waitForTimeout(1000);
  const atHiding = Number(state.ticks);
  await page.waitForTimeout(4000);
  await hide(false);
  await page.mouse.move(x + 20, y);
  await page.waitForTimeout(500);
  await page.mouse.move(x, y);
  await until('ticks', ticks => Number(ticks) > atHiding + 200);
  const whileHidden = Number(state.ticks) - atHiding;
  claim(whileHidden < 3500, `${whileHidden} ticks have run while the page was hidden for five seconds`);

  // B puts the instrument down.
  await hold({ pressed: [1] });
  await until('pointer', pointer => pointer === 'free');
  await hold(undefined);
  await finishLesson(opened);
  await saveBundle(opened, zip);
  await close();
  console.log(JSON.stringify({ tilted, light, hard, pointing, pressing, pulled, whileHidden }));
});
