// SCORM 1.2 and SCORM 2004 (4th edition) run-time: ADL SCORM Run-Time Environment, chapters 3 and 4.

import { packed, unpacked } from './result.js';

/** Windows that are searched for the platform's interface, before giving up: the number that ADL's own example uses. */
const WINDOWS_MAX = 500;

/** The platform's object of this name, in the windows above this one and in those of its opener; null if there is none. */
export function findApi(name, from = window) {
  for (const start of [from.parent, from.opener, from.parent && from.parent.opener]) {
    let place = start;
    for (let searched = 0; place && searched < WINDOWS_MAX; searched++) {
      try {
        if (place[name]) return place[name];
      } catch {
        break; // A window of another origin: what is above it may not be seen, either.
      }
      if (place === place.parent) break;
      place = place.parent;
    }
  }
  return null;
}

const pad = (value, digits) => String(value).padStart(digits, '0');

/** CMITimespan, HHHH:MM:SS.SS. */
export function timespan(seconds) {
  const hundredths = Math.round(Math.min(seconds, 9999 * 3600) * 100);
  const whole = Math.floor(hundredths / 100);
  return `${pad(Math.floor(whole / 3600), 4)}:${pad(Math.floor(whole / 60) % 60, 2)}:${pad(whole % 60, 2)}.${pad(hundredths % 100, 2)}`;
}

/** A duration of ISO 8601 to hundredths of a second. */
export const duration = seconds => `PT${Math.round(seconds * 100) / 100}S`;

/** Names of elements and functions in the two versions. */
const VERSIONS = {
  '1.2': {
    api: 'API',
    functions: { begin: 'LMSInitialize', get: 'LMSGetValue', set: 'LMSSetValue', commit: 'LMSCommit', end: 'LMSFinish', error: 'LMSGetLastError', text: 'LMSGetErrorString' },
    learner: 'cmi.core.student_id', language: 'cmi.student_preference.language', mode: 'cmi.core.lesson_mode', exit: 'cmi.core.exit',
    time: ['cmi.core.session_time', timespan], suspendMax: 4096,
  },
  '2004': {
    api: 'API_1484_11',
    functions: { begin: 'Initialize', get: 'GetValue', set: 'SetValue', commit: 'Commit', end: 'Terminate', error: 'GetLastError', text: 'GetErrorString' },
    learner: 'cmi.learner_id', language: 'cmi.learner_preference.language', mode: 'cmi.mode', exit: 'cmi.exit',
    time: ['cmi.session_time', duration], suspendMax: 64000,
  },
};

/** A connection to a platform that speaks SCORM. */
export class Scorm {
  constructor(version, api) {
    this.names = VERSIONS[version];
    this.version = version;
    this.api = api;
    this.began = Date.now();
    this.isOpen = false;
    this.interactions = 0;
  }

  /** The connection that this window has; null without one. */
  static find(version) {
    const api = findApi(VERSIONS[version].api);
    return api && new Scorm(version, api);
  }

  call(name, ...values) {
    return String(this.api[this.names.functions[name]](...values));
  }

  /** The platform's own words for what went wrong last. */
  failure() {
    const code = this.call('error');
    return `${this.call('text', code) || 'error'} (${code})`;
  }

  get(element) {
    const value = this.call('get', element);
    return value === 'undefined' || value === 'null' ? '' : value;
  }

  /** Sets an element; throws with the platform's words if it is refused. */
  set(element, value) {
    if (this.call('set', element, String(value)) !== 'true') throw new Error(`${element}: ${this.failure()}`);
  }

  /** Sets an element that a platform may lack. */
  offer(element, value) {
    this.call('set', element, String(value));
  }

  /** Opens the connection: gives the learner, the language, whether this is a review, and the result that was kept. */
  async begin() {
    if (this.call('begin', '') !== 'true') throw new Error(this.failure());
    this.isOpen = true;
    this.interactions = Number(this.get('cmi.interactions._count')) || 0;
    const mode = this.get(this.names.mode);
    if (mode === 'normal' || !mode) this.markBegun();
    return {
      learner: this.get(this.names.learner), language: this.get(this.names.language), isReview: mode === 'review', isBrowse: mode === 'browse',
      kept: unpacked(this.get('cmi.suspend_data')),
    };
  }

  markBegun() {
    const status = this.version === '1.2' ? 'cmi.core.lesson_status' : 'cmi.completion_status';
    if (['not attempted', 'unknown', ''].includes(this.get(status))) this.offer(status, 'incomplete');
  }

  /** Delivers a result; the essential elements must be accepted. */
  async deliver(result) {
    if (this.version === '1.2') this.setGrade12(result);
    else this.setGrade2004(result);
    this.setInteractions(result);
    this.offer('cmi.suspend_data', packed(result, this.names.suspendMax));
    this.setTime();
    if (this.call('commit', '') !== 'true') throw new Error(this.failure());
  }

  setGrade12(result) {
    if (result.percent !== null) {
      this.offer('cmi.core.score.min', 0);
      this.offer('cmi.core.score.max', 100);
      this.set('cmi.core.score.raw', result.percent);
    }
    this.set('cmi.core.lesson_status', status12(result));
    this.offer('cmi.comments', `SHA-256 ${result.zip}: ${result.sha256}`);
  }

  setGrade2004(result) {
    if (result.percent !== null) {
      this.offer('cmi.score.min', 0);
      this.offer('cmi.score.max', 100);
      this.set('cmi.score.raw', result.percent);
      this.set('cmi.score.scaled', Math.round(result.percent * 100) / 10000);
    }
    if (result.passed !== null) this.set('cmi.success_status', result.passed ? 'passed' : 'failed');
    this.set('cmi.completion_status', result.finished ? 'completed' : 'incomplete');
    const comment = Number(this.get('cmi.comments_from_learner._count')) || 0;
    this.offer(`cmi.comments_from_learner.${comment}.comment`, `SHA-256 ${result.zip}: ${result.sha256}`);
  }

  /** One interaction per criterion of the grade: the points earned, of how many. */
  setInteractions(result) {
    const [response, sets] = this.version === '1.2' ? ['student_response', ['time', clock(new Date())]]
      : ['learner_response', ['timestamp', new Date().toISOString().slice(0, 22) + 'Z']];
    for (const item of result.items) {
      const place = `cmi.interactions.${this.interactions}`;
      this.offer(`${place}.id`, item.metric.replace(/[^A-Za-z0-9_.-]/g, '_').slice(0, 250));
      this.offer(`${place}.type`, 'numeric');
      this.offer(`${place}.${sets[0]}`, sets[1]);
      this.offer(`${place}.weighting`, item.max);
      this.offer(`${place}.${response}`, item.points);
      this.offer(`${place}.result`, item.points);
      if (this.version === '2004') this.offer(`${place}.description`, (item.title || item.metric).slice(0, 250));
      this.interactions += 1;
    }
  }

  setTime() {
    const [element, format] = this.names.time;
    this.offer(element, format((Date.now() - this.began) / 1000));
  }

  /** Closes the connection; may be called while the page is being left, and more than once. */
  end() {
    if (!this.isOpen) return;
    this.isOpen = false;
    this.setTime();
    // The attempt stays open: one may try again, and a review finds what was kept.
    this.offer(this.names.exit, 'suspend');
    this.call('commit', '');
    this.call('end', '');
  }
}

/** cmi.core.lesson_status: SCORM 1.2 has one word for success and completion. */
function status12(result) {
  if (result.passed !== null) return result.passed ? 'passed' : 'failed';
  return result.finished ? 'completed' : 'incomplete';
}

/** CMITime, HH:MM:SS. */
const clock = date => `${pad(date.getHours(), 2)}:${pad(date.getMinutes(), 2)}:${pad(date.getSeconds(), 2)}`;
