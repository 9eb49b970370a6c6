//! Logins of the database and their roles: what each may do is decided by the database (`migrations/0002_roles.sql`).

use postgres::{Client, Error};

/// Role of a login.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LoginRole {
    /// Writes its own sessions, and reads no others.
    Station,
    /// Reads the sessions of its classes, and overrides grades.
    Examiner,
    /// Reads, exports and erases all sessions.
    Registrar,
    /// Scores queued sessions.
    Worker,
}

impl LoginRole {
    pub fn name(self) -> &'static str {
        match self {
            LoginRole::Station => "station",
            LoginRole::Examiner => "examiner",
            LoginRole::Registrar => "registrar",
            LoginRole::Worker => "worker",
        }
    }
}

/// Request to admit a login.
#[derive(Clone, Copy, Debug)]
pub struct AdmitRequest<'a> {
    pub login: &'a str,
    pub role: LoginRole,
    /// Classes of an examiner.
    pub classes: &'a [String],
    /// SCRAM verifier of the password; the password itself is never transmitted, since the server may log it.
    pub password_verifier: Option<&'a str>,
    /// True if the password of a login that exists may be replaced.
    pub replaces_password: bool,
}

/// Result of a request to admit a login. Nothing is changed unless it was admitted.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum AdmitOutcome {
    /// Contains the names of all roles that the login now has.
    Admitted(Vec<String>),
    UnknownClass(String),
    /// The rules about rows do not apply to the login; contains the reason.
    TooPowerful(String),
    /// The login exists, and its password must not be replaced.
    Exists,
}

/// Reason for which no rule about rows would hold for an existing login, empty if there is none; no row for a new login.
const PRIVILEGES_SQL: &str = "SELECT CASE
    WHEN r.rolsuper THEN 'is a superuser'
    WHEN pg_has_role(r.oid, d.datdba, 'MEMBER') THEN 'owns the database'
    WHEN pg_has_role(r.oid, n.nspowner, 'MEMBER') THEN 'owns the tables'
    WHEN r.rolbypassrls THEN 'has the attribute BYPASSRLS'
    WHEN r.rolcreaterole THEN 'has the attribute CREATEROLE'
    WHEN r.rolreplication THEN 'has the attribute REPLICATION'
    WHEN NOT r.rolcanlogin THEN 'is a group of logins'
    ELSE '' END
  FROM pg_roles r, pg_database d, pg_namespace n
  WHERE r.rolname = $1 AND d.datname = current_database() AND n.nspname = 'typodont'";

/// Creates the login if necessary, and grants the role.
///
/// # Errors
/// The database's error; nothing is changed then.
pub fn admit(client: &mut Client, request: &AdmitRequest) -> Result<AdmitOutcome, Error> {
    let AdmitRequest { login, role, classes, password_verifier, replaces_password } = *request;
    let mut transaction = client.transaction()?;
    let found = transaction.query_opt(PRIVILEGES_SQL, &[&login])?;
    let is_there = found.is_some();
    if let Some(row) = found {
        let privilege: String = row.get(0);
        if !privilege.is_empty() {
            return Ok(AdmitOutcome::TooPowerful(privilege));
        }
        if password_verifier.is_some() && !replaces_password {
            return Ok(AdmitOutcome::Exists);
        }
    }
    // The server quotes the names and values of these statements itself (`format`).
    let mut execute_formatted = |sql: &str, words: [&str; 2]| -> Result<(), Error> {
        let [first, second] = words;
        let sentence: String = transaction.query_one(sql, &[&first, &second])?.get(0);
        transaction.batch_execute(&sentence)
    };
    if !is_there {
        execute_formatted("SELECT format('CREATE ROLE %I LOGIN', $1::text, $2::text)", [login, ""])?;
    }
    if let Some(verifier) = password_verifier {
        execute_formatted("SELECT format('ALTER ROLE %I PASSWORD %L', $1::text, $2::text)", [login, verifier])?;
    }
    let group = format!("typodont_{}", role.name());
    execute_formatted("SELECT format('GRANT %I TO %I', $1::text, $2::text)", [&group, login])?;
    for class in classes {
        let sql = "INSERT INTO typodont.examines (login, class_id) SELECT $1, id FROM typodont.class WHERE name = $2
          ON CONFLICT (login, class_id) DO UPDATE SET login = excluded.login";
        if transaction.execute(sql, &[&login, class])? == 0 {
            return Ok(AdmitOutcome::UnknownClass(class.clone()));
        }
    }
    let detail = format!("{login} as {}", role.name());
    transaction.query("SELECT typodont.note('admitted', $1)", &[&detail])?;
    let sql = "SELECT substr(g.rolname, 10) FROM pg_roles g JOIN pg_auth_members m ON m.roleid = g.oid
      JOIN pg_roles l ON l.oid = m.member
      WHERE l.rolname = $1 AND g.rolname LIKE 'typodont\\_%' ORDER BY 1";
    let roles = transaction.query(sql, &[&login])?.iter().map(|row| row.get(0)).collect();
    transaction.commit()?;
    Ok(AdmitOutcome::Admitted(roles))
}
