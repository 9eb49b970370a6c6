// Opens pages of a cohort in Chromium from the disk, on a wide and a narrow window, in light and dark colours.
//
//     node cohort_page.js PLAYWRIGHT-CORE CHROMIUM FOLDER-OF-PICTURES PAGE.html…
//
// Prints the number of pages. Exits with 1 and a line per claim that does not hold.

const path = require('path');
const { appearance } = require('./page_checks.js');

const [playwright, executablePath, pictures, ...files] = process.argv.slice(2);
const { chromium } = require(playwright);

(async () => {
  const browser = await chromium.launch({ executablePath, args: ['--no-sandbox'] });
  const context = await browser.newContext({ viewport: { width: 1280, height: 1000 }, locale: 'en-GB' });
  const wrong = [];
  for (const file of files) {
    const page = await context.newPage(), name = path.basename(file, '.html');
    page.on('console', message => { if (message.type() === 'error') wrong.push(`${name}: logged: ${message.text()}`); });
    page.on('request', request => { if (!/^(file|data):/.test(request.url())) wrong.push(`${name}: asked of a network: ${request.url()}`); });
    await page.goto(`file://${path.resolve(file)}`);
    wrong.push(...(await appearance(page)).map(line => `${name}: ${line}`));
    for (const [width, colorScheme] of [[1280, 'light'], [1280, 'dark'], [400, 'light']]) {
      await page.emulateMedia({ colorScheme });
      await page.setViewportSize({ width, height: 1000 });
      await page.screenshot({ path: path.join(pictures, `${name}-${width}-${colorScheme}.png`), fullPage: true });
    }
    await page.close();
  }
  await browser.close();
  console.log(`${files.length} pages`);
  for (const line of wrong) console.error(line);
  process.exit(wrong.length ? 1 : 0);
})().catch(error => { console.error(error); process.exit(1); });
