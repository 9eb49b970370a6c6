// cmi5 (Quartz), a launch by xAPI: https://github.com/AICC/CMI-5_Spec_Current/blob/quartz/cmi5_spec.md

import { packed, unpacked } from './result.js';
import { duration } from './scorm.js';

const VERB = 'http://adlnet.gov/expapi/verbs/';
/** Verb ids that are not ADL's own. */
const VERBS = { terminated: `${VERB}terminated`, initialized: `${VERB}initialized`, completed: `${VERB}completed`, passed: `${VERB}passed`, failed: `${VERB}failed` };
const CATEGORY = 'https://w3id.org/xapi/cmi5/context/categories/';
const PARAMETERS = ['endpoint', 'fetch', 'actor', 'registration', 'activityId'];
/** State document of a result, and extensions of its statement. */
const STATE = 'typodont-result';
const EXTENSION = 'https://github.com/typodont/typodont/xapi/';
const KEPT_MAX = 64000;

/** A UUID of version 4, also where a page without HTTPS has no `crypto.randomUUID`. */
function uuid() {
  const bytes = crypto.getRandomValues(new Uint8Array(16));
  bytes[6] = bytes[6] & 0x0f | 0x40;
  bytes[8] = bytes[8] & 0x3f | 0x80;
  const digits = Array.from(bytes, byte => byte.toString(16).padStart(2, '0')).join('');
  return [[0, 8], [8, 12], [12, 16], [16, 20], [20, 32]].map(([from, to]) => digits.slice(from, to)).join('-');
}

/** A connection to a platform that launched this page by cmi5. */
export class Cmi5 {
  constructor(launch) {
    this.launch = launch;
    this.actor = JSON.parse(launch.actor);
    this.began = Date.now();
    this.isOpen = false;
    /** Verbs of this session. */
    this.stated = new Set();
    /** Verbs of the registration, by this session and earlier ones, that may be stated once in it. */
    this.registered = new Set();
    this.kept = null;
  }

  /** The connection that this page's address describes; null if it describes none. */
  static find(address) {
    const parameters = new URL(address).searchParams;
    if (!PARAMETERS.every(name => parameters.has(name))) return null;
    return new Cmi5(Object.fromEntries(PARAMETERS.map(name => [name, parameters.get(name)])));
  }

  async request(method, path, parameters, body, isLast = false) {
    const url = new URL(path, this.launch.endpoint.replace(/\/*$/, '/'));
    for (const [name, value] of Object.entries(parameters)) url.searchParams.set(name, value);
    const headers = { Authorization: `Basic ${this.token}`, 'X-Experience-API-Version': '1.0.3' };
    if (body !== undefined) headers['Content-Type'] = 'application/json';
    const response = await fetch(url, { method, headers, body: body === undefined ? undefined : JSON.stringify(body), keepalive: isLast });
    const isAbsent = method === 'GET' && response.status === 404;
    if (!response.ok && !isAbsent) throw new Error(`${method} ${path}: ${response.status} ${(await response.text()).slice(0, 200)}`);
    return response;
  }

  state(name) {
    return { activityId: this.launch.activityId, agent: this.launch.actor, registration: this.launch.registration, stateId: name };
  }

  async document(path, parameters) {
    const response = await this.request('GET', path, parameters);
    return response.status === 404 ? null : response.json();
  }

  /** Opens the connection: gives the learner, the language, whether this is a review, and the result that was kept. */
  async begin() {
    const fetched = await fetch(this.launch.fetch, { method: 'POST' });
    const answer = await fetched.json();
    this.token = answer['auth-token'];
    if (!this.token) throw new Error(answer['error-text'] || `${fetched.status}`);
    this.data = await this.document('activities/state', this.state('LMS.LaunchData'));
    if (!this.data) throw new Error('LMS.LaunchData');
    const preferences = await this.document('agents/profile', { agent: this.launch.actor, profileId: 'cmi5LearnerPreferences' }).catch(() => null);
    const kept = await this.document('activities/state', this.state(STATE));
    this.kept = kept && typeof kept === 'object' ? kept : null;
    if (Array.isArray(this.kept?.stated)) this.kept.stated.forEach(verb => this.registered.add(verb));
    await this.say('initialized', {}, []);
    this.isOpen = true;
    const learner = this.actor.account ? this.actor.account.name : this.actor.name || '';
    return {
      learner, language: (preferences && preferences.languagePreference || '').split(',')[0],
      isReview: this.data.launchMode === 'Review', isBrowse: this.data.launchMode === 'Browse', kept: unpacked(JSON.stringify(this.kept)),
    };
  }

  async say(verb, result, categories, isLast = false) {
    const template = this.data.contextTemplate || {};
    const context = {
      ...template, registration: this.launch.registration,
      contextActivities: {
        ...template.contextActivities,
        category: [...(template.contextActivities?.category || []), ...['cmi5', ...categories].map(name => ({ id: CATEGORY + name }))],
      },
    };
    const statement = {
      id: uuid(), actor: this.actor, verb: { id: VERBS[verb], display: { en: verb } }, object: { objectType: 'Activity', id: this.launch.activityId },
      context, timestamp: new Date().toISOString(),
    };
    if (Object.keys(result).length) statement.result = result;
    await this.request('PUT', 'statements', { statementId: statement.id }, statement, isLast);
    this.stated.add(verb);
  }

  /** States a verb that the standard allows once in a registration, and keeps that it was stated for the launches to come. */
  async sayOnce(verb, result) {
    await this.say(verb, result, ['moveon']);
    this.registered.add(verb);
    await this.keep(this.kept);
  }

  /** Keeps a document for the launches to come, with the verbs that none of them may state again. */
  async keep(content) {
    this.kept = { ...content, stated: [...this.registered] };
    await this.request('PUT', 'activities/state', this.state(STATE), this.kept);
  }

  /** Delivers a result. A verb that the standard allows once in a registration is stated once; what is kept is always the newest. */
  async deliver(result) {
    if (this.data.launchMode && this.data.launchMode !== 'Normal') return;
    const time = duration(result.seconds);
    const extensions = { [`${EXTENSION}bundle-sha256`]: result.sha256, [`${EXTENSION}items`]: result.items };
    const score = result.percent === null ? {} : { score: { scaled: Math.round(result.percent * 100) / 10000, raw: result.percent, min: 0, max: 100 } };
    const judged = { ...score, success: result.passed, duration: time, extensions };
    // After "passed", neither verb may follow in the same registration; "failed" may be stated once in each session before it.
    if (result.passed !== null && !this.registered.has('passed')) {
      if (result.passed) await this.sayOnce('passed', judged);
      else if (!this.stated.has('failed')) await this.say('failed', judged, ['moveon']);
    }
    if (result.finished && !this.registered.has('completed')) await this.sayOnce('completed', { completion: true, duration: time });
    await this.keep(JSON.parse(packed(result, KEPT_MAX)));
  }

  /** Closes the connection; may be called while the page is being left, and more than once. */
  end() {
    if (!this.isOpen) return;
    this.isOpen = false;
    this.say('terminated', { duration: duration((Date.now() - this.began) / 1000) }, [], true).catch(() => {});
  }
}
