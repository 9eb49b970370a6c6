// Checks of a page's appearance that hold for every page: nothing is cut off, no word is broken, every text can be read.

/** What runs within the page. Each check gives a line for each element that fails. */
const inPage = {
  /** Elements whose right edge is beyond that of the box in which they scroll, or of the window. */
  clipped: () => {
    const name = element => `${element.tagName.toLowerCase()}.${element.getAttribute('class') || ''} ${element.textContent.trim().slice(0, 40)}`;
    const found = [];
    for (const element of document.querySelectorAll('body *')) {
      const style = getComputedStyle(element), box = element.getBoundingClientRect();
      if (box.width === 0 || box.height === 0 || style.visibility === 'hidden' || element.closest('svg') !== null && element.tagName !== 'svg') continue;
      if (element.closest('.unseen, thead') && style.clipPath !== 'none' || element.closest('.unseen')) continue;
      if (element.closest('thead') && getComputedStyle(element.closest('thead')).clipPath !== 'none') continue;
      let holder = element.parentElement;
      while (holder && holder !== document.body && !/auto|scroll|hidden/.test(getComputedStyle(holder).overflowX)) holder = holder.parentElement;
      const right = !holder || holder === document.body ? document.documentElement.clientWidth : holder.getBoundingClientRect().right;
      if (box.right > right + 0.5) found.push(`${name(element)}: ${Math.round(box.right - right)} px`);
    }
    return found;
  },

  /** Words of up to 24 letters that are on two lines. */
  broken: () => {
    const found = [];
    const texts = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
    for (let node = texts.nextNode(); node; node = texts.nextNode()) {
      const parent = node.parentElement;
      const head = parent && parent.closest('thead');
      if (!parent || parent.closest('script, style, code, svg, .unseen, [hidden]') || parent.offsetParent === null) continue;
      if (head && getComputedStyle(head).clipPath !== 'none') continue;
      for (const { 0: word, index } of node.data.matchAll(/[\p{L}\p{N}_]+/gu)) {
        if (word.length > 24) continue;
        const range = document.createRange();
        range.setStart(node, index);
        range.setEnd(node, index + word.length);
        const lines = new Set([...range.getClientRects()].filter(box => box.width > 0).map(box => Math.round(box.top)));
        if (lines.size > 1) found.push(`"${word}" in ${parent.tagName.toLowerCase()}`);
      }
    }
    return found;
  },

  /** Texts whose contrast with what is behind them is below 4.5 to 1 (3 to 1 if they are large), as WCAG 2 has it. */
  faint: () => {
    const parsed = text => (text.match(/[\d.]+/g) || []).map(Number);
    const luminance = ([r, g, b]) => {
      const linear = [r, g, b].map(v => (v / 255 <= 0.04045 ? v / 255 / 12.92 : ((v / 255 + 0.055) / 1.055) ** 2.4));
      return 0.2126 * linear[0] + 0.7152 * linear[1] + 0.0722 * linear[2];
    };
    const found = [];
    for (const element of document.querySelectorAll('body *')) {
      const isText = [...element.childNodes].some(node => node.nodeType === 3 && node.data.trim());
      const box = element.getBoundingClientRect();
      if (!isText || box.width === 0 || element.closest('script, style, .unseen, [hidden]')) continue;
      const style = getComputedStyle(element), isDrawn = element.closest('svg') !== null;
      const front = parsed(isDrawn ? style.fill : style.color);
      let behind = element, back = [0, 0, 0, 0];
      // A flag's number is on its disc.
      const disc = element.closest('.mark') && element.closest('.mark').querySelector('circle');
      if (disc) back = parsed(getComputedStyle(disc).fill);
      else for (; behind && (back.length === 4 && back[3] === 0); behind = behind.parentElement) back = parsed(getComputedStyle(behind).backgroundColor);
      if (back.length === 4 && back[3] === 0) back = [255, 255, 255];
      const [light, dark] = [luminance(front), luminance(back)].sort((a, b) => b - a);
      const ratio = (light + 0.05) / (dark + 0.05), size = parseFloat(style.fontSize);
      const least = size >= 24 || size >= 18.66 && Number(style.fontWeight) >= 700 ? 3 : 4.5;
      if (ratio < least) found.push(`${element.tagName.toLowerCase()}.${element.getAttribute('class') || ''} "${element.textContent.trim().slice(0, 30)}": ${ratio.toFixed(2)}`);
    }
    return found;
  },
};

/** Checks the page at 1280 and 400 pixels, light and dark; gives the lines of what fails. */
async function appearance(page) {
  const wrong = [];
  const say = (where, lines) => { for (const line of [...new Set(lines)].slice(0, 8)) wrong.push(`${where}: ${line}`); };
  for (const width of [1280, 400]) {
    await page.setViewportSize({ width, height: 900 });
    say(`cut off at ${width} pixels`, await page.evaluate(inPage.clipped));
    say(`a word is broken at ${width} pixels`, await page.evaluate(inPage.broken));
  }
  await page.setViewportSize({ width: 1280, height: 900 });
  const grounds = new Set();
  for (const colorScheme of ['light', 'dark']) {
    await page.emulateMedia({ colorScheme });
    grounds.add(await page.evaluate(() => getComputedStyle(document.body).backgroundColor));
    say(`faint in ${colorScheme} colours`, await page.evaluate(inPage.faint));
  }
  if (grounds.size !== 2) wrong.push('the page has no dark colours');
  await page.emulateMedia({ colorScheme: 'light' });
  return wrong;
}

module.exports = { appearance };
