// The pictures of docs/results.md and of the README from the reports of the suite `paper`, in Chromium:
//
//     (cd tests/browser && npm ci) && node docs/pictures.mjs runs/paper
import { createRequire } from 'node:module';
import { dirname, join, resolve } from 'node:path';
import { fileURLToPath, pathToFileURL } from 'node:url';

const docs = dirname(fileURLToPath(import.meta.url));
const { chromium } = createRequire(join(docs, '../tests/browser/'))('playwright-core');
const results = resolve(process.argv[2]);

// File, study, what is played (protocol, episode, seed, left, right, step), what is seen.
const PICTURES = [
  ['report', 'square_unison', 'regular,0,0,mpg,td3,60,1', { x: 0, y: 0, width: 1400, height: 1960 }],
  ['report-learning', 'square_unison', '', '#curves'],
  ['result-circle', 'track_circle', 'circle,0,0,mpg,td3,60,1', '.stages'],
  ['result-unison', 'square_unison', 'regular,0,0,mpg,td3,60,1', '.stages'],
  ['result-consensus', 'consensus_triangle/variants/filtered', 'random,1,0,mpg,distance_gradient,25,1', '.stages'],
  ['result-obstacles', 'regulation_obstacles/variants/filtered', 'crossing,0,0,mpg,predictive,105,1', '.stages'],
];

const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox', '--disable-gpu', '--disable-background-networking'] });
for (const [name, study, played, seen] of PICTURES) {
  const page = await browser.newPage({ viewport: { width: seen.width ?? 1400, height: 900 }, colorScheme: 'light', reducedMotion: 'reduce' });
  const address = pathToFileURL(join(results, study, 'report.html')).href;
  await page.goto(played ? `${address}#play=${played}` : address);
  const path = join(docs, `${name}.png`);
  // Charts are drawn when they come into sight.
  await page.locator(typeof seen === 'string' ? seen : '.stages').first().scrollIntoViewIfNeeded();
  await page.waitForTimeout(800);
  if (typeof seen === 'string') await page.locator(seen).first().screenshot({ path });
  else await page.screenshot({ path, fullPage: true, clip: seen });
  await page.close();
}
await browser.close();
