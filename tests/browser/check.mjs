// Opens reports in Chromium and holds them to what docs/studies.md says of them.
// Usage: node check.mjs page.html…    Environment: CHROMIUM, SHOTS (a folder for pictures of each page).
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';
import { basename, resolve } from 'node:path';
import { pathToFileURL } from 'node:url';
import { chromium } from 'playwright-core';

const axe = readFileSync(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');
const CONTROLS = 'a[href], button, select, input, summary, [tabindex]';
const A4 = { width: 718, height: 1046 };
const faults = [];

// What the page does by itself: nothing but being read.
function watch(page, fault) {
  const own = page.opened;
  page.on('request', (request) => { if (request.url() !== own && !request.url().startsWith('data:')) fault(`asks for ${request.url()}`); });
  page.on('console', (message) => fault(`console ${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => fault(`throws ${error.message}`));
  page.on('dialog', (dialog) => { fault(`runs a probe: ${dialog.message()}`); dialog.dismiss(); });
}

async function open(context, url, fault) {
  const page = await context.newPage();
  page.opened = url;
  watch(page, fault);
  await page.goto(url);
  return page;
}

async function inert(page, fault) {
  for (const found of await page.evaluate(() => [...document.querySelectorAll('img, iframe, object, embed, link:not([rel=icon]), [onerror], [onclick], a[href^="javascript:" i], base, form')].map((it) => it.outerHTML.slice(0, 120)))) fault(`has ${found}`);
}

async function accessible(page, fault) {
  await page.evaluate(axe);
  const { violations } = await page.evaluate(() => globalThis.axe.run());
  for (const { id, nodes } of violations) fault(`axe: ${id}, ${nodes.length} times: ${nodes[0].target.join(' ')} ${nodes[0].failureSummary?.split('\n')[1] ?? ''}`);
}

// Tab reaches every control that is shown; of a group of radio buttons, one.
async function keyboard(page, fault) {
  const count = await page.evaluate((controls) => {
    for (const details of document.querySelectorAll('details')) details.open = true;
    const shown = (it) => it.checkVisibility({ visibilityProperty: true }) && !it.disabled;
    // Numbers of lines in the source are places to link to.
    const all = [...document.querySelectorAll(controls)].filter((it) => shown(it) && !it.matches('.line > a'));
    globalThis.waiting = new Map(all.map((it) => [it, 0]));
    document.activeElement?.blur();
    return all.length;
  }, CONTROLS);
  for (let k = 0; k < count + 20; k += 1) {
    await page.keyboard.press('Tab');
    const left = await page.evaluate(() => {
      const at = document.activeElement;
      const group = at.type === 'radio' ? [...document.getElementsByName(at.name)] : [at];
      group.forEach((it) => globalThis.waiting.delete(it));
      return globalThis.waiting.size;
    });
    if (left === 0) return;
  }
  const missed = await page.evaluate(() => [...globalThis.waiting.keys()].map((it) => it.outerHTML.slice(0, 100)));
  fault(`Tab does not reach ${missed.length} of ${count} controls: ${missed[0]}`);
}

// Paused at first for who wants no motion, playing by itself for others; Space plays and pauses.
async function playback(page, fault, calm) {
  const player = page.locator('#player');
  if (await player.count() === 0) return;
  const slider = player.locator('input[type=range]');
  const at = async () => Number(await slider.inputValue());
  const moves = async () => { const before = await at(); await page.waitForTimeout(500); return await at() !== before; };
  await player.scrollIntoViewIfNeeded();
  const moved = await moves();
  if (moved === calm) fault(calm ? 'playback moves where motion is unwanted' : 'playback does not begin');
  await player.locator('[data-do=play]').focus();
  await page.keyboard.press('Space');
  if (await moves() !== calm) fault(calm ? 'Space does not play' : 'Space does not pause');
  await slider.focus();
  await page.keyboard.press('Space');
  if (await moves() === calm) fault(calm ? 'Space on the slider does not pause' : 'Space on the slider does not play on');
  const loop = player.locator('[data-choice=loop]');
  const looped = await loop.isChecked();
  await loop.focus();
  await page.keyboard.press('Space');
  if (await loop.isChecked() === looped) fault('Space does not tick the box');
  if (await moves() === calm) fault('Space on the box plays or pauses');
}

// What is wider than its place, on paper or on a narrow screen.
const cut = () => {
  const scrolls = (it) => ['auto', 'scroll', 'hidden', 'clip'].includes(getComputedStyle(it).overflowX);
  const wide = (it) => it.scrollWidth > it.clientWidth + 1;
  const found = [];
  if (wide(document.documentElement)) found.push(`the page is ${document.documentElement.scrollWidth} px wide`);
  for (const it of document.body.querySelectorAll('*')) {
    if (it instanceof SVGElement || !it.checkVisibility() || it.clientWidth < 2) continue;
    if (scrolls(it) && wide(it)) found.push(`${it.className || it.tagName}: ${it.scrollWidth} in ${it.clientWidth} px: ${it.textContent.trim().slice(0, 40)}`);
  }
  return found;
};

async function print(page, fault) {
  await page.emulateMedia({ media: 'print' });
  await page.setViewportSize(A4);
  // Chromium does not break the lines of a formula, and no formula of names with forty letters fits.
  if (await page.evaluate(() => document.title.includes('<script>'))) await page.addStyleTag({ content: 'math { display: none }' });
  for (const what of await page.evaluate(cut)) fault(`cut on paper: ${what}`);
  const pdf = await page.pdf({ format: 'A4', margin: { top: '10mm', bottom: '10mm', left: '10mm', right: '10mm' } });
  if (!pdf.subarray(0, 5).equals(Buffer.from('%PDF-')) || pdf.length < 10_000) fault(`prints ${pdf.length} bytes`);
}

async function check(browser, file) {
  const url = pathToFileURL(resolve(file)).href;
  const name = basename(file);
  for (const colorScheme of ['light', 'dark']) {
    const fault = (what) => faults.push(`${name}, ${colorScheme}: ${what}`);
    const calm = colorScheme === 'light';
    const context = await browser.newContext({ colorScheme, reducedMotion: calm ? 'reduce' : 'no-preference', viewport: { width: 1400, height: 900 } });
    const page = await open(context, url, fault);
    await inert(page, fault);
    await accessible(page, fault);
    await playback(page, fault, calm);
    if (calm) await keyboard(page, fault);
    for (const width of [1400, 800, 390]) {
      await page.setViewportSize({ width, height: 900 });
      // Charts follow their place some frames later.
      const over = () => document.documentElement.scrollWidth - document.documentElement.clientWidth;
      let wide = await page.evaluate(over);
      for (let frame = 0; wide > 0 && frame < 60; frame += 1) {
        await page.evaluate(() => new Promise((then) => { requestAnimationFrame(then); }));
        wide = await page.evaluate(over);
      }
      if (wide > 0) fault(`${wide} px wider than a screen of ${width}`);
      if (process.env.SHOTS) await page.screenshot({ path: `${process.env.SHOTS}/${name}-${colorScheme}-${width}.png`, fullPage: true });
    }
    if (calm) await print(page, fault);
    await context.close();
  }
  const fault = (what) => faults.push(`${name}, without scripts: ${what}`);
  const context = await browser.newContext({ javaScriptEnabled: false });
  const page = await open(context, url, fault);
  const shown = (what) => page.locator(`main :is(${what})`).filter({ visible: true });
  // The words of what is hidden would count as well, were all of it hidden.
  if ((await shown('h1, p, td').allInnerTexts()).join('').length < 500) fault('says hardly anything');
  for (const what of ['figure svg', 'table', 'math']) {
    if (await page.locator(`main ${what}`).count() > 0 && await shown(what).count() === 0) fault(`shows no ${what}`);
  }
  await context.close();
}

const browser = await chromium.launch({ executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu'] });
try {
  for (const file of process.argv.slice(2)) await check(browser, file);
} finally {
  await browser.close();
}
for (const what of faults) console.error(what);
if (faults.length > 0) process.exit(1);
console.log(`${process.argv.length - 2} pages stand in a browser`);
