// The examiner's desk in Chromium, as an examiner uses it: by mouse, by keyboard, in two languages, on a narrow window.
//
//     node review_page.js PLAYWRIGHT-CORE CHROMIUM ADDRESS [PICTURES]
//
// Prints what it measured as JSON. Exits with 1 and a line per claim that does not hold.

const path = require('path');

const [playwright, executablePath, address, pictures] = process.argv.slice(2);
const { chromium } = require(playwright);

const wrong = [];
const claim = (holds, what) => { if (!holds) wrong.push(what); };
const origin = new URL(address).origin;

(async () => {
  const args = ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'];
  const browser = await chromium.launch({ executablePath, args });
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, locale: 'en-GB' });
  const asked = [];
  const watch = page => {
    page.on('console', message => { if (message.type() === 'error') wrong.push(`logged at ${page.url()}: ${message.text()}`); });
    page.on('pageerror', error => wrong.push(`thrown: ${error.message}`));
    page.on('dialog', dialog => { wrong.push(`a dialog: ${dialog.message()}`); dialog.dismiss(); });
    page.on('request', request => {
      if (!request.url().startsWith(origin) && !/^(data|blob):/.test(request.url())) asked.push(request.url());
    });
  };
  const page = await context.newPage();
  watch(page);
  const photograph = async (name, of = page) => {
    if (pictures) await of.screenshot({ path: path.join(pictures, name), fullPage: true });
  };
  const unnamed = () => page.evaluate(() => [...document.querySelectorAll('button, input:not([type=hidden]), select, textarea, a, summary, img')].filter(element => {
    const labels = [...(element.labels || [])].map(label => label.textContent).join('');
    return !(labels + (element.getAttribute('aria-label') || '') + (element.getAttribute('alt') || '') + element.textContent).trim();
  }).map(element => element.outerHTML));
  const beyond = () => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);
  const looks = async name => {
    for (const line of await unnamed()) wrong.push(`${name}: without a name: ${line}`);
    const doubled = await page.evaluate(() => { const ids = [...document.querySelectorAll('[id]')].map(e => e.id); return ids.filter((id, n) => ids.indexOf(id) !== n); });
    claim(doubled.length === 0, `${name}: ids stand twice: ${doubled}`);
    await photograph(`${name}.png`);
    await page.setViewportSize({ width: 400, height: 800 });
    claim(await beyond() <= 0, `${name}: ${await beyond()} pixels stand out of a window of 400`);
    await photograph(`${name}-narrow.png`);
    await page.setViewportSize({ width: 1280, height: 1000 });
  };

  // In by the address that opens once.
  await page.goto(address);
  await page.waitForURL(`${origin}/`);
  await page.waitForSelector('table.list');
  claim((await page.evaluate(() => document.cookie)) === '', 'a script could read the cookie');
  await looks('list');

  // Narrowed and sorted.
  await page.getByRole('columnheader', { name: 'Automatic points' }).getByRole('link').click();
  const order = await page.getByRole('columnheader', { name: 'Automatic points' }).getAttribute('aria-sort');
  claim(order === 'descending', `the list is ${order}`);
  const points = await page.locator('table.list tbody tr td:nth-of-type(4)').allTextContents();
  const numbers = points.map(text => parseFloat(text));
  claim(numbers.every((n, i) => i === 0 || n <= numbers[i - 1]), `not in order: ${numbers}`);
  await page.getByLabel('Result').selectOption('failed');
  await page.getByRole('button', { name: 'Show' }).click();
  claim((await page.locator('table.list tbody tr').count()) < numbers.length, 'the filter leaves everybody');
  await page.getByRole('link', { name: 'Show all' }).click();

  // Two of them side by side.
  const boxes = page.locator('input[name="session"]');
  await boxes.nth(0).check();
  await page.getByRole('button', { name: 'Compare' }).click();
  claim((await page.textContent('main')).includes('Select two sessions'), 'one session is compared with nothing');
  await photograph('complaint.png');
  await page.goBack();
  await boxes.nth(0).check();
  await boxes.nth(1).check();
  await page.getByRole('button', { name: 'Compare' }).click();
  await page.waitForSelector('table.compare');
  const loaded = () => page.evaluate(async () => {
    for (const image of document.images) image.loading = 'eager';
    await Promise.all([...document.images].map(image => image.decode().catch(() => {})));
    return [...document.images].filter(image => !image.naturalWidth).map(image => image.src);
  });
  claim((await loaded()).length === 0, `pictures are missing: ${await loaded()}`);
  claim((await page.locator('figure img').count()) >= 4, 'no maps side by side');
  await looks('compare');

  // An item overridden, by keyboard alone.
  await page.goto(`${origin}/?sort=machine`);
  await page.locator('table.list tbody a').first().click();
  claim((await loaded()).length === 0, `pictures are missing: ${await loaded()}`);
  await looks('session');
  await page.locator('#item-0 summary').first().focus();
  await page.keyboard.press('Enter');
  await page.keyboard.press('Tab');
  await page.keyboard.press('Control+A');
  await page.keyboard.type('40');
  await page.keyboard.press('Tab');
  await page.keyboard.type('<script>alert(1)</script> The rest of the decay is stained, sound dentine.');
  await page.keyboard.press('Tab');
  await page.keyboard.type('Dr. Öz');
  await photograph('session-form.png');
  await page.keyboard.press('Enter');
  await page.waitForURL(/#item-0$/);
  const item = await page.textContent('#item-0');
  claim(item.includes('40') && item.includes('<script>alert(1)</script> The rest'), `the item says ${item}`);
  const name = await page.locator('#item-1 input[name="name"]').inputValue();
  claim(name === 'Dr. Öz', `the next form has the name "${name}"`);
  // What is missing is asked for by the browser itself.
  await page.locator('#grade summary').first().click();
  await page.locator('#grade button').first().click();
  claim(await page.evaluate(() => document.activeElement.name) === 'passed', 'passed or not passed is chosen for the examiner');
  await page.locator('#grade input[name="passed"]').first().check();
  await page.locator('#grade button').first().click();
  claim(await page.evaluate(() => document.activeElement.name) === 'reason', 'an empty reason is sent');
  // The forms stand beside the picture of the work.
  const beside = await page.evaluate(() => {
    const [picture, form] = ['.work .pictures img', '#item-0 form'].map(one => document.querySelector(one).closest('.pictures, .forms').getBoundingClientRect());
    return picture.right <= form.left;
  });
  claim(beside, 'the forms do not stand beside the picture');
  await looks('session-overridden');
  await page.locator('#item-0 summary').nth(1).click();
  await photograph('session-withdraw.png');

  // The session's own report runs in a room of its own, and cannot judge.
  const [report] = await Promise.all([context.waitForEvent('page'), page.getByRole('link', { name: 'session report' }).click()]);
  watch(report);
  await report.waitForFunction(() => document.documentElement.dataset.shown, null, { timeout: 60000 });
  const alone = await report.evaluate(() => {
    let cookie = '';
    try { cookie = document.cookie; } catch (error) { cookie = error.name; }
    return { origin: self.origin, cookie };
  });
  claim(alone.origin === 'null' && ['', 'SecurityError'].includes(alone.cookie), `the report has ${JSON.stringify(alone)}`);
  await photograph('report.png', report);
  await report.close();

  await page.goto(`${origin}/history`);
  await looks('history');
  await page.goto(`${origin}/left-out`);
  await looks('left-out');

  // In Turkish nothing of the English is left but what people wrote.
  await page.goto(`${origin}/?overridden=yes`);
  await page.getByRole('link', { name: 'Türkçe' }).click();
  claim(page.url().includes('overridden=yes'), `the other language leads to ${page.url()}`);
  claim((await page.getAttribute('html', 'lang')) === 'tr', 'the page does not say its language');
  await photograph('list-turkish.png');
  await page.locator('table.list tbody a').first().click();
  const text = await page.textContent('main');
  for (const english of ['Override', 'Automatic', 'Reason', 'Passed', 'Points']) claim(!text.includes(english), `"${english}" is left in Turkish`);
  await photograph('session-turkish.png');

  await page.getByRole('button', { name: 'Çıkış' }).click();
  await photograph('door-left.png');
  await page.goto(`${origin}/`);
  claim(!(await page.textContent('body')).includes('student'), 'who has left still sees the list');
  claim(asked.length === 0, `asked of others: ${asked.join(' ')}`);
  await browser.close();
  console.log(JSON.stringify({ sessions: numbers.length }));
  // A browser logs the statuses that are meant: a refusal is no error of the page.
  const meant = line => /^logged at .*status of (403|422)/.test(line);
  const left = wrong.filter(line => !meant(line));
  for (const line of left) console.error(line);
  process.exit(left.length ? 1 : 0);
})().catch(error => { for (const line of wrong) console.error(line); console.error(error); process.exit(1); });
