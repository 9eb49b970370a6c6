// Opens an exercise for a learning platform, and tells the platform its result.
//
// The exercise runs in a frame of its own; it knows nothing of platforms and says what happened by messages:
// `{ typodont: 1, event: "result", session: <session.json>, zip: { name, sha256 } }`.

import { Cmi5 } from './cmi5.js';
import { counting, participantCode, resultOf } from './result.js';
import { Scorm } from './scorm.js';

const TEXTS = {
  en: {
    connecting: 'Connecting to the learning platform …',
    connected: '',
    delivered: 'The learning platform has your result.',
    browse: 'This is a preview: the learning platform takes no result.',
    none: 'This page was not opened by a learning platform: no grade is delivered. Save the result and hand in the file.',
    failed: 'No grade was delivered: {why}. Save the result and hand in the file {zip}.',
    refused: 'The learning platform did not answer as its standard says ({why}): no grade will be delivered. Save the result and hand in the file.',
    title: 'Your result', criterion: 'Criterion', points: 'Points', of: '{points} of {max}', passed: 'Passed', notPassed: 'Not passed', done: 'Completed',
    file: 'Hand-in file', digest: 'Its SHA-256', nothing: 'There is no result to review yet.', error: 'Critical error: {title}',
  },
  tr: {
    connecting: 'Öğrenme platformuna bağlanılıyor …',
    connected: '',
    delivered: 'Sonucunuz öğrenme platformuna iletildi.',
    browse: 'Bu bir önizlemedir: öğrenme platformu sonuç kaydetmez.',
    none: 'Bu sayfa bir öğrenme platformundan açılmadı: not iletilmez. Sonucu kaydedip dosyayı teslim edin.',
    failed: 'Not iletilemedi: {why}. Sonucu kaydedip {zip} dosyasını teslim edin.',
    refused: 'Öğrenme platformu standardına uygun yanıt vermedi ({why}): not iletilmeyecek. Sonucu kaydedip dosyayı teslim edin.',
    title: 'Sonucunuz', criterion: 'Ölçüt', points: 'Puan', of: '{points} / {max}', passed: 'Geçti', notPassed: 'Geçemedi', done: 'Tamamlandı',
    file: 'Teslim dosyası', digest: 'SHA-256 özeti', nothing: 'Henüz gözden geçirilecek bir sonuç yok.', error: 'Kritik hata: {title}',
  },
};

const parameters = new URLSearchParams(location.search);
const frame = document.getElementById('exercise');
const status = document.getElementById('status');
let language = 'en';

/** Text of a key, with its arguments filled in. */
function text(key, values = {}) {
  return TEXTS[language][key].replace(/\{(\w+)\}/g, (whole, name) => String(values[name] ?? whole));
}

function speak(code) {
  const short = (code || navigator.language || 'en').slice(0, 2).toLowerCase();
  language = TEXTS[short] ? short : 'en';
  document.documentElement.lang = language;
}

function show(key, values, isWrong = false) {
  status.textContent = text(key, values);
  status.classList.toggle('wrong', isWrong);
  document.documentElement.dataset.state = key;
}

const element = (name, content, className) => {
  const made = document.createElement(name);
  made.textContent = content;
  if (className) made.className = className;
  return made;
};

/** Shows the result that the platform has kept, in place of the exercise. */
function review(result) {
  const main = document.getElementById('review');
  main.hidden = false;
  main.append(element('h1', text('title')));
  if (!result) return main.append(element('p', text('nothing')));
  const verdict = result.passed === null ? text('done') : text(result.passed ? 'passed' : 'notPassed');
  main.append(element('p', result.percent === null ? verdict : `${result.percent} % · ${verdict}`));
  for (const title of result.errors) main.append(element('p', text('error', { title })));
  const table = document.createElement('table');
  const row = (kind, first, second) => {
    const made = document.createElement('tr');
    made.append(element(kind, first), element(kind, second, 'number'));
    table.append(made);
  };
  row('th', text('criterion'), text('points'));
  for (const item of result.items) row('td', item.title || item.metric, text('of', { points: item.points, max: item.max }));
  if (result.items.length) main.append(table);
  main.append(element('p', `${text('file')}: ${result.zip}`));
  const digest = element('p', `${text('digest')}: `);
  digest.append(element('code', result.sha256));
  main.append(digest);
}

/** The platform that opened this page; null if none did. */
function findPlatform(course) {
  if (course.standard === 'cmi5') return Cmi5.find(location.href);
  return Scorm.find(course.standard);
}

function openExercise(course, learner) {
  const number = Number(parameters.get('exercise')) || 0;
  const exercise = course.exercises[number] || course.exercises[0];
  const query = new URLSearchParams({ exercise: exercise.file, participant: participantCode(learner), language });
  frame.title = exercise.title;
  document.title = exercise.title;
  frame.src = `page/index.html?${query}`;
  frame.hidden = false;
}

/** Delivers each result that the exercise announces. */
function listen(course, platform, kept) {
  let counted = kept;
  window.addEventListener('message', async message => {
    const isOurs = message.source === frame.contentWindow && message.origin === location.origin && message.data?.typodont === 1;
    if (!isOurs || message.data.event !== 'result') return;
    const latest = resultOf(message.data.session, message.data.zip, course.critical);
    if (!platform) return show('none', {}, true);
    counted = counting(counted, latest, course.take);
    try {
      await platform.deliver(counted);
      show('delivered');
    } catch (error) {
      show('failed', { why: error.message, zip: latest.zip }, true);
    }
  });
}

async function main() {
  speak(parameters.get('language'));
  const course = await (await fetch('course.json')).json();
  show('connecting');
  let platform = findPlatform(course);
  let opened = { learner: '', language: '', isReview: false, isBrowse: false, kept: null };
  let refusal = '';
  try {
    if (platform) opened = await platform.begin();
  } catch (error) {
    refusal = error.message;
  }
  // A launch that only looks at a result ends, too.
  if (platform && !refusal) window.addEventListener('pagehide', () => platform.end());
  speak(opened.language || parameters.get('language'));
  if (opened.isReview) {
    show('connected');
    review(opened.kept);
    return;
  }
  if (refusal) show('refused', { why: refusal }, true);
  else if (!platform) show('none', {}, true);
  else show(opened.isBrowse ? 'browse' : 'connected');
  const isDelivering = platform && !refusal && !opened.isBrowse;
  listen(course, isDelivering ? platform : null, opened.kept);
  openExercise(course, opened.learner);
}

main().catch(error => {
  show('refused', { why: error.message }, true);
});
