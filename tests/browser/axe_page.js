// Looks for barriers around the canvas with axe-core: at the list, and where an exercise cannot be had.
//
//     node axe_page.js PLAYWRIGHT-CORE CHROMIUM PAGE AXE-CORE
//
// Exits with 1 and a line per serious or critical violation.

const fs = require('fs');
const path = require('path');
const { claim, main, open } = require('./served_page.js');

const [playwright, executablePath, folder, axeCore] = process.argv.slice(2);
const source = fs.readFileSync(path.join(axeCore, 'axe.min.js'), 'utf8');

main(async () => {
  const { page, address, until, close } = await open({ playwright, executablePath, folder, adapter: 'webgl' });
  const look = async where => {
    await page.evaluate(source);
    const { violations, passes } = await page.evaluate(() => axe.run());
    claim(passes.length > 5, `${where}: axe has looked at ${passes.length} rules only`);
    for (const { id, impact, help, nodes } of violations) {
      const line = `${where}: ${impact} ${id}: ${help}: ${nodes.map(node => node.html.slice(0, 80)).join(' ')}`;
      claim(!['serious', 'critical'].includes(impact), line);
      console.log(line);
    }
  };
  await page.goto(`${address}?state-log`);
  await until('screen', screen => screen === 'shelf');
  await look('list');
  // Of a file outside the page's folder, nothing is asked from a server.
  await page.goto(`${address}?exercise=http://elsewhere.example/a.json`);
  await page.waitForSelector('#status.no-exercise');
  await look('no exercise');
  await close();
});
